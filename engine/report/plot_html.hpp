// Plots in a page: each can be saved as SVG, and the data that it was drawn from as CSV.
#pragma once

#include "engine/report/gnuplot.hpp"

#include <span>
#include <string>

namespace trocar::engine {

/// A grid of figures with their buttons, the data, once for each file, and the script of the buttons. Loads nothing.
[[nodiscard]] std::string plots_html(std::span<const Plot> plots);

/// Where a value of 0 is drawn on a logarithmic axis, beside a tick that says 0: at least half a decade below the smallest other value, between
/// two decades, whose ticks have labels of their own.
/// least     smallest value above 0; infinity: there is none
[[nodiscard]] double zero_on_logarithmic_axis(double least) noexcept;

} // namespace trocar::engine
