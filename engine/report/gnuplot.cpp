#include "engine/report/gnuplot.hpp"

#include "engine/io/atomic_file.hpp"
#include "engine/io/file_bytes.hpp"
#include "engine/prepare/process.hpp"

#include <fmt/format.h>

namespace trocar::engine {

namespace {

constexpr double kTimeLimit = 60.0; // s, for all plots

constexpr const char* kPlotStyle = R"(
set encoding utf8
set border 3 lc rgb '#9aa3ad' lw 1
set tics nomirror out scale 0.5 textcolor rgb '#4b5563'
set grid ytics lc rgb '#e6e9ed' lw 1 lt 1
set key top left horizontal Left reverse samplen 1.6 textcolor rgb '#374151' maxrows 1
set key at graph 0, 1.12
set tmargin 1.9
set rmargin 2.5
set style fill solid 0.25 noborder
)";

std::string script_of(const std::vector<Sketch>& sketches) {
    std::string script;
    for (const Sketch& sketch : sketches)
        script += fmt::format("reset\nset terminal svg size {},{} dynamic enhanced font 'Helvetica,14' background '#ffffff'\n"
                              "set output '{}.svg'\n{}{}\nunset output\n",
                              sketch.width, sketch.height, sketch.plot.name, kPlotStyle, sketch.commands);
    return script;
}

void replace_all(std::string& text, const std::string& piece, const std::string& other) {
    for (std::size_t at = text.find(piece); at != std::string::npos; at = text.find(piece, at + other.size()))
        text.replace(at, piece.size(), other);
}

} // namespace

std::string inline_svg(std::string svg, const std::string& name) {
    const std::size_t begin = svg.find("<svg");
    if (begin == std::string::npos) return {};
    svg.erase(0, begin);
    for (const char* id :
         {"gnuplot_plot_", "gnuplot_canvas", "gpDot", "gpPt", "hypertextBox", "hypertext", "textbox", "greybox", "gridoutline"}) {
        replace_all(svg, fmt::format("id=\"{}", id), fmt::format("id=\"{}_{}", name, id));
        replace_all(svg, fmt::format("id='{}", id), fmt::format("id='{}_{}", name, id));
        replace_all(svg, fmt::format("#{}", id), fmt::format("#{}_{}", name, id));
    }
    return svg;
}

Result<std::vector<Plot>> draw_plots(const std::vector<Sketch>& sketches, const std::vector<PlotData>& data) {
    const Result<std::filesystem::path> gnuplot = find_program("gnuplot", "gnuplot-nox");
    if (!gnuplot) return gnuplot.error();
    const Result<TemporaryFolder> folder = TemporaryFolder::make();
    if (!folder) return folder.error();
    for (const PlotData& file : data)
        if (Result<void> written = write_file_atomically(folder->path() / file.name, file.text); !written) return written.error();
    if (Result<void> written = write_file_atomically(folder->path() / "plots.gp", script_of(sketches)); !written) return written.error();
    const Result<ProcessOutcome> outcome = run_process(*gnuplot, {"-d", "plots.gp"}, folder->path(), kTimeLimit, OnInterrupt::Finish);
    if (!outcome) return outcome.error();
    const Error failed{.code = ErrorCode::ToolFailed,
                       .message = "gnuplot drew nothing: " +
                                  (outcome->timed_out ? fmt::format("it took more than {} s", kTimeLimit) : outcome->output)};
    if (outcome->timed_out || outcome->exit_code != 0) return failed;
    std::vector<Plot> plots;
    for (const Sketch& sketch : sketches) {
        const Result<std::string> svg = read_file_bytes(folder->path() / (sketch.plot.name + ".svg"));
        if (!svg) return failed;
        plots.push_back(sketch.plot);
        plots.back().svg = inline_svg(*svg, sketch.plot.name);
        for (const PlotData& file : data)
            if (sketch.commands.find("'" + file.name + "'") != std::string::npos) plots.back().data.push_back(file);
    }
    return plots;
}

std::string quote_for_gnuplot(const std::string& text) {
    std::string safe = "'";
    for (const char c : text) {
        if (c == '\'')
            safe += "''";
        else if (c == '_' || c == '^' || c == '@' || c == '&' || c == '~' || c == '{' || c == '}' || c == '\\')
            safe += ' ';
        else if (static_cast<unsigned char>(c) >= 0x20)
            safe += c;
    }
    return safe + "'";
}

} // namespace trocar::engine
