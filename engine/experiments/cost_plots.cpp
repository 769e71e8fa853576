// The plots of `cost`: errors over two times, contacts, and curves over simulated time.
#include "engine/experiments/cost_page.hpp"

#include "engine/report/gnuplot.hpp"
#include "engine/report/html.hpp"
#include "engine/report/verdict.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <limits>

namespace trocar::engine {

namespace {

constexpr const char* kColours[] = {"#2158d6", "#d97706", "#0f8a6d", "#7c3aed", "#d64545", "#0891b2", "#6b7280", "#a16207"};
/// mm; what is equal to the last bit has no place on a logarithmic axis: it is drawn here.
constexpr double kNothing = 1e-7;
constexpr double kNoTime = 1e-6; // ms, likewise

const char* colour(std::size_t row) { return kColours[row % std::size(kColours)]; }

std::string curve_file(std::size_t row) { return fmt::format("curve_{}.tsv", row); }

std::string curve_text(const CostRow& row) {
    std::string text;
    for (const CostPoint& p : row.curve)
        fmt::format_to(std::back_inserter(text), "{:.9g}\t{}\t{}\t{:.7g}\t{:.5g}\t{:.5g}\n", p.time_s, p.level, p.pairs_open,
                       std::max(1e3 * p.tip_distance_m, kNothing), p.step_ms, std::max(p.charged_ms, kNoTime));
    return text;
}

/// With more names than fit into a legend, the names stand at their points.
constexpr std::size_t kNamesInLegend = 6;

/// One line per budget over time, as the scene says.
Sketch sketch_over_time(const CostTable& table, Plot plot, int column, const char* label, bool logarithmic) {
    Sketch sketch;
    sketch.plot = std::move(plot);
    sketch.commands = fmt::format(
        "set xlabel 'time [s]' textcolor rgb '#4b5563' offset 0,0.4\nset ylabel '{}' textcolor rgb '#4b5563' offset 1,0\n{}plot ", label,
        logarithmic ? "set logscale y\nset format y '10^{%L}'\n" : "set yrange [0:*]\nset offsets 0, 0, graph 0.2, 0\n");
    for (std::size_t k = 0; k < table.rows.size(); ++k)
        if (!table.rows[k].curve.empty() && table.rows[k].variant.empty())
            sketch.commands += fmt::format("'{}' using 1:{} with lines lw 1.5 lc rgb '{}' title {}, ", curve_file(k), column, colour(k),
                                           quote_for_gnuplot(table.rows[k].name()));
    return sketch;
}

/// An error over two times: what the budget's scope took, and the whole step.
struct ErrorPlot {
    const char* id;
    const char* title;
    const char* caption;
    const SurfaceDistance CostRow::*error;
};

double error_of(const CostRow& row, const ErrorPlot& plot) { return std::max(1e3 * (row.*plot.error).rms(), kNothing); }

/// The frontier: budgets that no other beats both in what they were charged and in error.
std::string frontier_text(const CostTable& table, const ErrorPlot& plot) {
    std::vector<std::pair<double, double>> points;
    for (const CostRow& row : table.rows)
        if (row.steps > 0) points.emplace_back(row.charged_ms.p50, error_of(row, plot));
    std::sort(points.begin(), points.end());
    std::string text;
    double best = std::numeric_limits<double>::infinity();
    for (const auto& [ms, error] : points)
        if (error < best) {
            best = error;
            fmt::format_to(std::back_inserter(text), "{:.6g}\t{:.6g}\n", std::max(ms, kNoTime), error);
        }
    return text.empty() ? "NaN NaN\n" : text;
}

/// Charged, whole step, error.
std::string point_text(const CostRow& row, const ErrorPlot& plot) {
    if (row.steps == 0) return "NaN NaN NaN\n";
    return fmt::format("{:.6g}\t{:.6g}\t{:.6g}\n", std::max(row.charged_ms.p50, kNoTime), std::max(row.step_ms.p50, kNoTime),
                       error_of(row, plot));
}

constexpr ErrorPlot kErrorPlots[] = {
    {"error", "Error of a step against time",
     "Root mean square distance of the surfaces from the exact run's, after a step from the same state and its answer's effect on the next",
     &CostRow::surface},
    {"trajectory", "Divergence of the trajectory against time",
     "Root mean square distance of the surfaces from the exact run's, each run by itself: trajectories that have parted need not come "
     "nearer "
     "as the budget grows",
     &CostRow::trajectory},
};

/// Left of it no budget can be kept.
std::string floor_mark(const CostTable& table) {
    if (!(table.floor_ms > 0.0)) return {};
    return fmt::format("set arrow from {0:.6g}, graph 0 to {0:.6g}, graph 1 nohead lc rgb '#6b7280' lw 1.4 dt (2,4)\n"
                       "set label 'floor' at {0:.6g}, graph 0.97 left offset 0.5,0 textcolor rgb '#6b7280'\n",
                       table.floor_ms);
}

Sketch sketch_error(const CostTable& table, const Scene& scene, const ErrorPlot& plot) {
    Sketch sketch;
    sketch.plot = {plot.id,
                   plot.title,
                   fmt::format("{}. Over two medians: full dots, what the budget for {} was charged; rings, the whole step. The line joins "
                               "the budgets that no other beats in both charge and error. Where nothing differs to the last bit they "
                               "stand at 10^-7 mm.{}",
                               plot.caption, scope_text(scene.budget),
                               table.floor_ms > 0.0 ? fmt::format(" The floor, {} ms, is what a budget of nothing is charged where most touches.",
                                                                  number_text(table.floor_ms))
                                                    : ""),
                   {}};
    sketch.commands = fmt::format(
        "set logscale xy\nset format '10^{{%L}}'\nset xlabel 'ms: full dots charged for {}, rings whole step' textcolor rgb '#4b5563' "
        "offset 0,0.4\nset ylabel 'mm' textcolor rgb '#4b5563' offset 1,0\nset offsets graph 0.1, graph 0.1, graph 0.1, graph 0.1\n"
        "{}plot 'frontier_{}.tsv' using 1:2 with lines lw 1.2 lc rgb '#9aa3ad' dt (6,4) notitle, ",
        scope_text(scene.budget), floor_mark(table), plot.id);
    const bool at_points = table.rows.size() > kNamesInLegend;
    for (std::size_t k = 0; k < table.rows.size(); ++k) {
        const std::string name = quote_for_gnuplot(table.rows[k].name());
        sketch.commands += fmt::format("'{0}_{1}.tsv' using 1:3 with points pt 7 ps 1.1 lc rgb '{2}' {3}, '' using 2:3 with points pt 6 ps "
                                       "1.1 lc rgb '{2}' notitle, ",
                                       plot.id, k, colour(k), at_points ? "notitle" : "title " + name);
        if (at_points)
            sketch.commands +=
                fmt::format("'' using 1:3:({}) with labels left rotate by {} offset 0.6,{} font ',8' textcolor rgb '{}' notitle, ", name,
                            k % 2 == 0 ? 20 : -20, k % 2 == 0 ? 0.3 : -0.3, colour(k));
    }
    return sketch;
}

/// Missed and false contacts side by side, as shares of the reference.
Sketch sketch_contacts(std::size_t rows) {
    Sketch sketch;
    sketch.plot = {"contacts",
                   "Contacts against the exact answer",
                   "Patches in contact, summed over the steps: those that the exact answer has and this one has not, and the reverse.",
                   {}};
    sketch.commands = "set ylabel 'patches' textcolor rgb '#4b5563' offset 1,0\nset yrange [0:*]\nset offsets 0, 0, graph 0.2, 0\nset "
                      "style data histogram\n"
                      "set style histogram clustered gap 1.2\nset boxwidth 0.9\nset style fill solid 0.85 noborder\nset xtics nomirror" +
                      std::string(rows > kNamesInLegend ? " rotate by -50 left font ',9'" : "") +
                      "\n"
                      "plot 'contacts.tsv' using 2:xtic(1) lc rgb '#c02626' title 'missed', '' using 3 lc rgb '#e0a23c' title 'false', "
                      "'' using 4 lc rgb '#a9bfe8' title 'in the exact answer'";
    return sketch;
}

std::vector<PlotData> plot_files(const CostTable& table) {
    std::vector<PlotData> files;
    for (const ErrorPlot& plot : kErrorPlots) {
        files.push_back({fmt::format("frontier_{}.tsv", plot.id), frontier_text(table, plot)});
        for (std::size_t k = 0; k < table.rows.size(); ++k)
            files.push_back({fmt::format("{}_{}.tsv", plot.id, k), point_text(table.rows[k], plot)});
    }
    std::string contacts;
    for (std::size_t k = 0; k < table.rows.size(); ++k) {
        const CostRow& row = table.rows[k];
        files.push_back({curve_file(k), curve_text(row)});
        std::string name = quote_for_gnuplot(row.name()); // gnuplot's columns are split at blanks
        name = "\"" + name.substr(1, name.size() - 2) + "\"";
        fmt::format_to(std::back_inserter(contacts), "{} {} {} {}\n", name, row.contacts.missed, row.contacts.spurious,
                       row.contacts.reference);
    }
    files.push_back({"contacts.tsv", contacts});
    return files;
}

} // namespace

std::string cost_plots(const Scene& scene, CostTable& table) {
    if (std::all_of(table.rows.begin(), table.rows.end(), [](const CostRow& row) { return row.curve.empty(); })) return {};
    std::vector<Sketch> sketches{sketch_error(table, scene, kErrorPlots[0]), sketch_contacts(table.rows.size()),
                                 sketch_error(table, scene, kErrorPlots[1])};
    sketches.push_back(sketch_over_time(
        table, {"level", "Level reached", "Coarsest level still open when the descent ended; higher is finer.", {}}, 2, "level", false));
    sketches.push_back(sketch_over_time(
        table, {"open", "Open pairs", "Pairs of spheres that the budget left untested, assumed to collide.", {}}, 3, "pairs", false));
    if (!scene.instruments.empty())
        sketches.push_back(sketch_over_time(table,
                                            {"tip",
                                             "Distance of the tip from the exact run's",
                                             "Where a run equals the exact one to the last bit it stands at 10^-7 mm.",
                                             {}},
                                            4, "mm", true));
    const char* slowest = "Where several steps share a point, the slowest.";
    sketches.push_back(sketch_over_time(
        table, {"charged", fmt::format("Time charged to the budget: {}", scope_text(scene.budget)), slowest, {}}, 6, "ms", true));
    sketches.push_back(sketch_over_time(
        table, {"times", "Time of the whole step", fmt::format("Whatever the budget is for. {}", slowest), {}}, 5, "ms", true));
    const auto plots = draw_plots(sketches, plot_files(table));
    if (!plots) {
        table.notices.push_back("no plots: " + plots.error().to_string());
        return fmt::format("<p class=\"soft\">No plots: {}</p>\n", escape_html(plots.error().to_string()));
    }
    std::string page = "<div class=\"grid\">\n";
    for (const Plot& plot : *plots)
        fmt::format_to(std::back_inserter(page),
                       "<figure><h3>{0}</h3><div role=\"img\" aria-label=\"{0}\">{1}</div><figcaption>{2}</figcaption></figure>\n",
                       escape_html(plot.title), plot.svg, escape_html(plot.caption));
    return page + "</div>\n";
}

} // namespace trocar::engine
