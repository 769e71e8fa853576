// Plots in a page: each can be saved as SVG, and the data that it was drawn from as CSV.
#pragma once

#include "engine/report/gnuplot.hpp"

#include <span>
#include <string>

namespace trocar::engine {

/// A grid of figures with their buttons, the data, once for each file, and the script of the buttons. Loads nothing.
[[nodiscard]] std::string plots_html(std::span<const Plot> plots);

} // namespace trocar::engine
