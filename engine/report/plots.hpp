// A run as curves, drawn by gnuplot in a process of its own.
#pragma once

#include "engine/report/gnuplot.hpp"
#include "engine/report/summary.hpp"

#include <string>
#include <vector>

namespace trocar::engine {

/// The plots that this run has data for.
/// fails  MissingTool without gnuplot, ToolFailed with its message
[[nodiscard]] Result<std::vector<Plot>> make_plots(const RunRecord& record);

} // namespace trocar::engine
