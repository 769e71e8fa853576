// The plots of `cost`: errors over two times, contacts, and curves over simulated time.
#include "engine/experiments/cost_page.hpp"

#include "engine/report/gnuplot.hpp"
#include "engine/report/html.hpp"
#include "engine/report/plot_html.hpp"
#include "engine/report/verdict.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

namespace trocar::engine {

namespace {

constexpr const char* kColours[] = {"#2158d6", "#d97706", "#0f8a6d", "#7c3aed", "#d64545", "#0891b2", "#6b7280", "#a16207"};
constexpr double kNoTime = 1e-6; // ms, likewise

const char* colour(std::size_t row) { return kColours[row % std::size(kColours)]; }

std::string curve_file(std::size_t row) { return fmt::format("curve_{}.tsv", row); }

std::string curve_text(const CostRow& row) {
    std::string text;
    for (const CostPoint& p : row.curve)
        fmt::format_to(std::back_inserter(text), "{:.9g}\t{}\t{}\t{:.7g}\t{:.5g}\t{:.5g}\n", p.time_s, p.level, p.pairs_open,
                       1e3 * p.tip_distance_m, p.step_ms, std::max(p.charged_ms, kNoTime));
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

double true_error(const CostRow& row, const ErrorPlot& plot) { return 1e3 * (row.*plot.error).rms(); }

/// mm; see zero_on_logarithmic_axis.
double place_of_zero(const CostTable& table, const ErrorPlot& plot) {
    double least = std::numeric_limits<double>::infinity();
    for (const CostRow& row : table.rows)
        if (const double error = true_error(row, plot); error > 0.0) least = std::min(least, error);
    return zero_on_logarithmic_axis(least);
}

double error_of(const CostTable& table, const CostRow& row, const ErrorPlot& plot) {
    const double error = true_error(row, plot);
    return error > 0.0 ? error : place_of_zero(table, plot);
}

bool any_error(const CostTable& table, const ErrorPlot& plot) {
    return std::any_of(table.rows.begin(), table.rows.end(), [&](const CostRow& row) { return true_error(row, plot) > 0.0; });
}

bool any_zero(const CostTable& table, const ErrorPlot& plot) {
    return std::any_of(table.rows.begin(), table.rows.end(), [&](const CostRow& row) { return row.steps > 0 && !(true_error(row, plot) > 0.0); });
}

/// The frontier: budgets that no other beats both in what they were charged and in error.
std::string frontier_text(const CostTable& table, const ErrorPlot& plot) {
    std::vector<std::pair<double, double>> points;
    for (const CostRow& row : table.rows)
        if (row.steps > 0) points.emplace_back(row.charged_ms.p50, error_of(table, row, plot));
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
std::string point_text(const CostTable& table, const CostRow& row, const ErrorPlot& plot) {
    if (row.steps == 0) return "NaN NaN NaN\n";
    return fmt::format("{:.6g}\t{:.6g}\t{:.6g}\n", std::max(row.charged_ms.p50, kNoTime), std::max(row.step_ms.p50, kNoTime),
                       error_of(table, row, plot));
}

constexpr ErrorPlot kErrorPlots[] = {
    {"error", "Error of a step against time",
     "Root mean square distance of the surfaces from the exact run's, one step after the same state",
     &CostRow::surface},
    {"trajectory", "Divergence of the trajectory against time",
     "Root mean square distance of the surfaces from the exact run's, each run by itself. Runs that have diverged need not come nearer as the "
     "budget grows",
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
                   fmt::format("{}. Horizontal: median time, charged to the budget for {} (full dots) and of the whole step (rings). The line joins "
                               "budgets that no other budget beats in both. A run that equals the exact one to the last bit is drawn at "
                               "the tick 0.{}",
                               plot.caption, scope_text(scene.budget),
                               table.floor_ms > 0.0 ? fmt::format(" The floor, {} ms, is the charge under a budget of 0 in the state with most contacts.",
                                                                  number_text(table.floor_ms))
                                                    : ""),
                   {}};
    sketch.commands = fmt::format(
        "set logscale xy\nset format '10^{{%L}}'\nset xlabel 'time of a step [ms]: full dots charged for {}, rings whole step' textcolor rgb '#4b5563' "
        "offset 0,0.4\nset ylabel 'distance [mm]' textcolor rgb '#4b5563' offset 1,0\n{}set offsets graph 0.1, graph 0.1, graph 0.1, graph 0.1\n"
        "{}plot 'frontier_{}.tsv' using 1:2 with lines lw 1.2 lc rgb '#9aa3ad' dt (6,4) notitle, ",
        scope_text(scene.budget), any_zero(table, plot) ? fmt::format("set ytics add ('0' {:.6g})\n", place_of_zero(table, plot)) : "",
        floor_mark(table), plot.id);
    if (table.floor_ms > 0.0) // whatever the others take, the axis reaches it
        sketch.commands += fmt::format("'{}_0.tsv' using ({:.6g}):3 with points pt -1 notitle, ", plot.id, table.floor_ms);
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
                   "Patches in contact, summed over the steps. Missed: only in the exact answer; false: only in the budget's answer.",
                   {}};
    sketch.commands = "set ylabel 'patches in contact' textcolor rgb '#4b5563' offset 1,0\nset yrange [0:*]\nset offsets 0, 0, graph 0.2, 0\nset "
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
        files.push_back({fmt::format("frontier_{}.tsv", plot.id), frontier_text(table, plot), "charged_ms,error_mm_or_place_of_zero"});
        for (std::size_t k = 0; k < table.rows.size(); ++k)
            files.push_back({fmt::format("{}_{}.tsv", plot.id, k), point_text(table, table.rows[k], plot), "charged_ms,step_ms,error_mm_or_place_of_zero"});
    }
    std::string contacts;
    for (std::size_t k = 0; k < table.rows.size(); ++k) {
        const CostRow& row = table.rows[k];
        files.push_back({curve_file(k), curve_text(row), "time_s,level_reached,pairs_open,tip_distance_mm,step_ms,charged_ms"});
        std::string name = quote_for_gnuplot(row.name()); // gnuplot's columns are split at blanks
        name = "\"" + name.substr(1, name.size() - 2) + "\"";
        fmt::format_to(std::back_inserter(contacts), "{} {} {} {}\n", name, row.contacts.missed, row.contacts.spurious,
                       row.contacts.reference);
    }
    files.push_back({"contacts.tsv", contacts, "budget,missed,false,in_the_exact_answer"});
    return files;
}

/// Does this number of any curve change over the run? Of distances: is any above 0?
template <class Of>
bool any_change(const CostTable& table, const Of& of) {
    for (const CostRow& row : table.rows)
        if (row.variant.empty() && !row.curve.empty())
            for (const CostPoint& p : row.curve)
                if (of(p) != of(row.curve.front())) return true;
    return false;
}

/// All alike is no plot: the table says it.
bool any_contact_differs(const CostTable& table) {
    return std::any_of(table.rows.begin(), table.rows.end(), [](const CostRow& row) { return row.contacts.missed + row.contacts.spurious > 0; });
}

} // namespace

std::string cost_plots(const Scene& scene, CostTable& table) {
    if (std::all_of(table.rows.begin(), table.rows.end(), [](const CostRow& row) { return row.curve.empty(); })) return {};
    std::vector<Sketch> sketches;
    for (const ErrorPlot& plot : kErrorPlots)
        if (any_error(table, plot)) sketches.push_back(sketch_error(table, scene, plot));
    if (any_contact_differs(table)) sketches.insert(sketches.begin() + (sketches.empty() ? 0 : 1), sketch_contacts(table.rows.size()));
    if (any_change(table, [](const CostPoint& p) { return p.level; }))
        sketches.push_back(sketch_over_time(table, {"level", "Level reached", "Coarsest level still open when the descent ended; higher is finer.", {}}, 2, "level of the trees", false));
    if (any_change(table, [](const CostPoint& p) { return p.pairs_open; }))
        sketches.push_back(sketch_over_time(table, {"open", "Open pairs", "Pairs of spheres that the budget left untested, assumed to collide.", {}}, 3, "open pairs of spheres", false));
    if (!scene.instruments.empty() && any_change(table, [](const CostPoint& p) { return p.tip_distance_m; }))
        sketches.push_back(sketch_over_time(table,
                                            {"tip",
                                             "Distance of the tip from the exact run's",
                                             "Where a run equals the exact one to the last bit there is no line.",
                                             {}},
                                            4, "distance [mm]", true));
    const char* slowest = "Where several steps share a point, the slowest is drawn.";
    sketches.push_back(sketch_over_time(
        table, {"charged", fmt::format("Time charged to the budget: {}", scope_text(scene.budget)), slowest, {}}, 6, "charged time of a step [ms]", true));
    sketches.push_back(sketch_over_time(
        table, {"times", "Time of the whole step", fmt::format("All of a step, whether charged to the budget or not. {}", slowest), {}}, 5, "time of a step [ms]", true));
    const auto plots = draw_plots(sketches, plot_files(table));
    if (!plots) {
        table.notices.push_back("no plots: " + plots.error().to_string());
        return fmt::format("<p class=\"soft\">No plots: {}</p>\n", escape_html(plots.error().to_string()));
    }
    return plots_html(*plots);
}

} // namespace trocar::engine
