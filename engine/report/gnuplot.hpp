// Plots drawn by gnuplot in a process of its own: data files and commands in, SVG elements out.
#pragma once

#include "base/result.hpp"

#include <string>
#include <vector>

namespace trocar::engine {

/// What the commands read, by name in their folder: blanks between columns.
struct PlotData {
    std::string name, text;
    std::string columns = {}; // names for a CSV file, joined by commas; may be empty
};

struct Plot {
    std::string name;    // short, a-z only
    std::string title;   // what is seen
    std::string caption; // how to read it
    std::string svg;     // an <svg> element that can stand inside a page
    std::vector<PlotData> data = {}; // that it was drawn from
};

/// A plot before gnuplot: its commands run after kPlotStyle.
struct Sketch {
    Plot plot;
    int width = 540, height = 300; // of the drawing's own units; the page scales it
    std::string commands;
};

/// fails  MissingTool without gnuplot, ToolFailed with its message
[[nodiscard]] Result<std::vector<Plot>> draw_plots(const std::vector<Sketch>& sketches, const std::vector<PlotData>& data);

/// A text in single quotes for a sketch's commands, without what gnuplot takes for markup.
[[nodiscard]] std::string quote_for_gnuplot(const std::string& text);

/// gnuplot's file as an element: without the XML prologue, its ids made different from those of other plots.
[[nodiscard]] std::string inline_svg(std::string svg, const std::string& name);

} // namespace trocar::engine
