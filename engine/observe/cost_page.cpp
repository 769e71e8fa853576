// The page of `cost`: what each budget gave up, as a table and as curves.
#include "engine/observe/cost_page.hpp"

#include "engine/observe/gnuplot.hpp"
#include "engine/observe/html.hpp"
#include "engine/observe/places.hpp"
#include "engine/observe/report_style.hpp"
#include "engine/observe/verdict.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

namespace seldinger::engine {

namespace {

constexpr const char* kColours[] = {"#2158d6", "#d97706", "#0f8a6d", "#7c3aed", "#d64545", "#0891b2", "#6b7280", "#a16207"};
/// mm; what is equal to the last bit has no place on a logarithmic axis: it is drawn here.
constexpr double kNothing = 1e-7;

const char* colour(std::size_t row) { return kColours[row % std::size(kColours)]; }

std::string curve_file(std::size_t row) { return fmt::format("curve_{}.tsv", row); }

std::string curve_text(const CostRow& row) {
    std::string text;
    for (const CostPoint& p : row.curve)
        fmt::format_to(std::back_inserter(text), "{:.9g}\t{}\t{}\t{:.7g}\t{:.5g}\n", p.time_s, p.level, p.pairs_open,
                       std::max(1e3 * p.tip_distance_m, kNothing), p.step_ms);
    return text;
}

/// More names than a legend has room for stand at their points.
constexpr std::size_t kNamesInLegend = 6;

bool has_variants(const CostTable& table) {
    return std::any_of(table.rows.begin(), table.rows.end(), [](const CostRow& row) { return !row.variant.empty(); });
}

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

/// Error against time, and the frontier: budgets that no other beats in both.
std::string frontier_text(const CostTable& table) {
    std::vector<std::pair<double, double>> points;
    for (const CostRow& row : table.rows)
        if (row.steps > 0) points.emplace_back(row.charged_ms.p50, std::max(1e3 * row.surface.rms(), kNothing));
    std::sort(points.begin(), points.end());
    std::string text;
    double best = std::numeric_limits<double>::infinity();
    for (const auto& [ms, error] : points)
        if (error < best) {
            best = error;
            fmt::format_to(std::back_inserter(text), "{:.6g}\t{:.6g}\n", std::max(ms, 1e-6), error);
        }
    return text.empty() ? "NaN NaN\n" : text;
}

std::string point_text(const CostRow& row) {
    if (row.steps == 0) return "NaN NaN\n";
    return fmt::format("{:.6g}\t{:.6g}\n", std::max(row.charged_ms.p50, 1e-6), std::max(1e3 * row.surface.rms(), kNothing));
}

Sketch sketch_error(const CostTable& table) {
    Sketch sketch;
    sketch.plot = {"error",
                   "Error against time",
                   "Root mean square distance of the surfaces from the exact run, over the median of what a step was charged. The line "
                   "joins the budgets that no other beats in both. Where a run equals the exact one to the last bit it stands at 10^-7 mm.",
                   {}};
    sketch.commands = "set logscale xy\nset format '10^{%L}'\nset xlabel 'charged [ms]' textcolor rgb '#4b5563' offset 0,0.4\n"
                      "set ylabel 'mm' textcolor rgb '#4b5563' offset 1,0\nset offsets graph 0.1, graph 0.1, graph 0.1, graph 0.1\n"
                      "plot 'frontier.tsv' using 1:2 with lines lw 1.2 lc rgb '#9aa3ad' dt (6,4) notitle, ";
    const bool at_points = table.rows.size() > kNamesInLegend;
    for (std::size_t k = 0; k < table.rows.size(); ++k) {
        const std::string name = quote_for_gnuplot(table.rows[k].name());
        sketch.commands += fmt::format("'point_{}.tsv' using 1:2 with points pt 7 ps 1.1 lc rgb '{}' {}, ", k, colour(k),
                                       at_points ? "notitle" : "title " + name);
        if (at_points)
            sketch.commands +=
                fmt::format("'' using 1:2:({}) with labels left rotate by {} offset 0.6,{} font ',8' textcolor rgb '{}' notitle, ", name,
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
    std::vector<PlotData> files{{"frontier.tsv", frontier_text(table)}};
    std::string contacts;
    for (std::size_t k = 0; k < table.rows.size(); ++k) {
        const CostRow& row = table.rows[k];
        files.push_back({curve_file(k), curve_text(row)});
        files.push_back({fmt::format("point_{}.tsv", k), point_text(row)});
        std::string name = quote_for_gnuplot(row.name()); // gnuplot's columns are split at blanks
        name = "\"" + name.substr(1, name.size() - 2) + "\"";
        fmt::format_to(std::back_inserter(contacts), "{} {} {} {}\n", name, row.contacts.missed, row.contacts.spurious,
                       row.contacts.reference);
    }
    files.push_back({"contacts.tsv", contacts});
    return files;
}

std::string make_plots(CostTable& table, bool instruments) {
    if (std::all_of(table.rows.begin(), table.rows.end(), [](const CostRow& row) { return row.curve.empty(); })) return {};
    std::vector<Sketch> sketches{sketch_error(table), sketch_contacts(table.rows.size())};
    sketches.push_back(sketch_over_time(
        table, {"level", "Level reached", "Coarsest level still open when the descent ended; higher is finer.", {}}, 2, "level", false));
    sketches.push_back(sketch_over_time(
        table, {"open", "Open pairs", "Pairs of spheres that the budget left untested, assumed to collide.", {}}, 3, "pairs", false));
    if (instruments)
        sketches.push_back(sketch_over_time(table,
                                            {"tip",
                                             "Distance of the tip from the exact run's",
                                             "Where a run equals the exact one to the last bit it stands at 10^-7 mm.",
                                             {}},
                                            4, "mm", true));
    sketches.push_back(
        sketch_over_time(table, {"times", "Time of a step", "Whole steps; where several share a point, the slowest.", {}}, 5, "ms", true));
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

std::string table_html(const CostTable& table) {
    std::string page = "<div class=\"scroll\"><table><tr><th>budget</th>";
    for (const char* head : {"step, median [ms]", "99 % [ms]", "kept", "open pairs", "leaf contacts", "level", "missed", "false",
                             "depth error [mm]", "force error", "surface RMS [mm]", "Hausdorff [mm]"})
        page += fmt::format("<th class=\"n\">{}</th>", head);
    page += "</tr>\n";
    for (const CostRow& row : table.rows) {
        page += fmt::format("<tr><td>{}</td>", escape_html(row.name()));
        for (const std::string& cell :
             {number_text(row.step_ms.p50), number_text(row.step_ms.p99), fmt::format("{:.2f} %", 100.0 * row.budget_kept),
              number_text(row.pairs_open_mean), number_text(row.leaf_contacts_mean), fmt::format("{:.2f}", row.level_reached_mean),
              fmt::format("{}", row.contacts.missed), fmt::format("{}", row.contacts.spurious), number_text(1e3 * row.depth_error_rms_m()),
              fmt::format("{:.2f} %", 100.0 * row.force_error_rel), number_text(1e3 * row.surface.rms()),
              number_text(1e3 * row.surface.hausdorff)})
            page += fmt::format("<td class=\"n\">{}</td>", cell);
        page += "</tr>\n";
    }
    return page + "</table></div>\n";
}

/// The first sentence: the cheapest budget that gave up nothing that matters, or what the tightest one cost.
std::string headline(const CostTable& table) {
    const CostRow* cheapest = nullptr;
    for (const CostRow& row : table.rows) {
        if (!row.variant.empty()) continue;
        const bool exact = row.steps > 0 && row.contacts.missed == 0 && row.contacts.spurious == 0 && row.surface.hausdorff == 0.0;
        if (exact && row.budget.limits.mode != BudgetMode::Exact && (cheapest == nullptr || row.charged_ms.p50 < cheapest->charged_ms.p50))
            cheapest = &row;
    }
    if (cheapest != nullptr) return fmt::format("{} a step is enough: its run equals the exact one to the last bit", cheapest->name());
    const auto own_end =
        table.rows.begin() + static_cast<std::ptrdiff_t>(
                                 std::count_if(table.rows.begin(), table.rows.end(), [](const CostRow& r) { return r.variant.empty(); }));
    const auto worst = std::max_element(table.rows.begin(), own_end,
                                        [](const CostRow& a, const CostRow& b) { return a.surface.hausdorff < b.surface.hausdorff; });
    if (worst == own_end || !(worst->surface.hausdorff > 0.0)) return "All runs equal the exact one to the last bit";
    return fmt::format("At {} a step the surfaces end up to {} mm from where exact contacts put them", worst->name(),
                       number_text(1e3 * worst->surface.hausdorff));
}

std::string pictures_html(std::span<const CostPicture> pictures) {
    if (pictures.empty()) return {};
    std::string page =
        fmt::format("<h2>The same instant under each budget, {:.2f} s</h2>\n<p>Spheres that count as contacts: dark red "
                    "where they were tested down to their leaves, light where the budget ended first.</p>\n<div class=\"grid\">\n",
                    pictures.front().time_s);
    for (const CostPicture& picture : pictures)
        fmt::format_to(std::back_inserter(page),
                       "<figure><img alt=\"{0}\" src=\"data:image/png;base64,{1}\"><figcaption><b>{0}</b>: {2} tested to the end, {3} left "
                       "open</figcaption></figure>\n",
                       escape_html(picture.name), encode_base64(picture.png), count_text(picture.tested, "pair", "pairs"), picture.assumed);
    return page + "</div>\n";
}

std::string how_measured(const Scene& scene, const CostTable& table) {
    std::string patches;
    for (std::size_t i = 0; i < table.patch_m.size(); ++i)
        patches += fmt::format("{}{} {} mm", i > 0 ? ", " : "", escape_html(scene.bodies[i].name), number_text(1e3 * table.patch_m[i]));
    return fmt::format(
        "<h2>How it was measured</h2>\n<p>Times, surfaces and tips come from a run under each budget by itself; surfaces were compared "
        "with "
        "the exact run's at {} instants. Contacts, depths, forces and lists come from asking every budget in every step of the exact run "
        "what it would have answered there. A contact is a patch of a surface in a step: cells of {}. Solids touch where their spheres "
        "come within {} mm, "
        "and pairs that the budget left open count as they do for the response; an instrument touches where the wall presses on it. A "
        "variant with other sphere trees than the scene's is compared with "
        "the surfaces themselves: what the exact answer takes for contacts lies beneath its own leaves.</p>\n"
        "<p class=\"soft\">The exact run's contact force is {} N (root mean square over steps and bodies). {} patches of solids were "
        "found within the tolerance by a search that shares nothing with the contact stages; {} of them lay beneath no contact of the "
        "exact "
        "descent, and in the others the spheres' depth was {} mm from the surfaces' (root mean square).</p>\n",
        table.compared_states, patches, number_text(1e3 * table.tolerance_m), number_text(table.force_rms_n), table.near_patches,
        table.near_uncovered, number_text(1e3 * table.near_depth_rms_m));
}

} // namespace

std::string cost_page(const Scene& scene, CostTable& table, std::span<const CostPicture> pictures) {
    const std::string plots = make_plots(table, !scene.instruments.empty());
    std::string page =
        fmt::format("<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
                    "content=\"width=device-width,initial-scale=1\">\n"
                    "<title>The price of accuracy: {0}</title>\n<style>{1}</style></head>\n<body><main>\n<p class=\"over\">{0}: the price "
                    "of accuracy</p>\n"
                    "<div class=\"verdict note\"><h1>{2}</h1>\n<p class=\"lead\">{3} under {4}, each against the exact run{5}.</p></div>\n",
                    escape_html(scene.name), kReportStyle, escape_html(headline(table)), count_text(table.steps, "step", "steps"),
                    count_text(table.rows.size(), "budget", "budgets"),
                    has_variants(table) ? ", as the scene says and answered other ways; curves over time are the scene's own" : "");
    page += table_html(table);
    if (!table.notices.empty()) {
        page += "<div class=\"notices\">";
        for (const std::string& notice : table.notices) page += fmt::format("<div>{}</div>", escape_html(notice));
        page += "</div>\n";
    }
    page += "<h2>Over budgets and time</h2>\n" + plots + pictures_html(pictures) + how_measured(scene, table);
    const Machine machine = describe_machine();
    page +=
        fmt::format("<footer>{}, {} cores, {}. The numbers of this page are in cost.csv and cost.json.</footer>\n</main></body></html>\n",
                    escape_html(machine.processor), machine.cores, escape_html(machine.compiler));
    return page;
}

} // namespace seldinger::engine
