// A run as curves, drawn by gnuplot in a process of its own.
#pragma once

#include "engine/observe/summary.hpp"

#include <string>
#include <vector>

namespace seldinger::engine {

struct Plot {
    std::string name;    // short, a-z only
    std::string title;   // what is seen
    std::string caption; // how to read it
    std::string svg;     // an <svg> element that can stand inside a page
};

/// The plots that this run has something to show for.
/// fails  MissingTool without gnuplot, ToolFailed with its words
[[nodiscard]] Result<std::vector<Plot>> make_plots(const RunRecord& record);

/// gnuplot's file as an element: without the XML prologue, its ids made different from those of other plots.
[[nodiscard]] std::string inline_svg(std::string svg, const std::string& name);

} // namespace seldinger::engine
