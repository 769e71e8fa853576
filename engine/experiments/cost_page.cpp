// The page of `cost`: the accuracy that each budget gave up, as a table and as curves.
#include "engine/experiments/cost_page.hpp"

#include "engine/experiments/cost_run.hpp"
#include "engine/report/build_facts.hpp"
#include "engine/report/html.hpp"
#include "engine/report/places.hpp"
#include "engine/report/report_style.hpp"
#include "engine/report/statistics.hpp"
#include "engine/report/verdict.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <initializer_list>
#include <iterator>
#include <vector>

namespace trocar::engine {

namespace {

bool has_variants(const CostTable& table) {
    return std::any_of(table.rows.begin(), table.rows.end(), [](const CostRow& row) { return !row.variant.empty(); });
}

/// One table; of all columns together the last would lie beyond a laptop's edge.
std::string part_html(const CostTable& table, std::initializer_list<const char*> heads,
                      const std::function<std::vector<std::string>(const CostRow&)>& cells) {
    std::string page = "<div class=\"scroll\"><table><tr><th>budget</th>";
    for (const char* head : heads) page += fmt::format("<th class=\"n wrap\">{}</th>", head);
    page += "</tr>\n";
    for (const CostRow& row : table.rows) {
        page += fmt::format("<tr><td>{}</td>", escape_html(row.name()));
        for (const std::string& cell : cells(row)) page += fmt::format("<td class=\"n\">{}</td>", cell);
        page += "</tr>\n";
    }
    return page + "</table></div>\n";
}

std::string table_html(const CostTable& table) {
    const auto times = [](const CostRow& row) {
        return std::vector<std::string>{number_text(row.charged_ms.p50), number_text(row.charged_ms.p99), number_text(row.step_ms.p50),
                                        number_text(row.step_ms.p99), fmt::format("{:.2f} %", percent_of(row.budget_kept)),
                                        fmt::format("{:.2f} %", 100.0 * row.realtime_kept), number_text(row.pairs_open_mean),
                                        number_text(row.leaf_contacts_mean), fmt::format("{:.2f}", row.level_reached_mean)};
    };
    const auto errors = [](const CostRow& row) {
        return std::vector<std::string>{fmt::format("{}", row.contacts.missed), fmt::format("{}", row.contacts.unseen), fmt::format("{}", row.contacts.spurious),
                                        number_text(1e3 * row.depth_error_rms_m()), fmt::format("{:.2f} %", 100.0 * row.force_error_rel),
                                        number_text(1e3 * row.surface.rms()), number_text(1e3 * row.surface.hausdorff),
                                        number_text(1e3 * row.trajectory.rms()), number_text(1e3 * row.trajectory.hausdorff)};
    };
    return "<h2>Time, and how far the tests went</h2>\n" +
           part_html(table,
                     {"charged, median [ms]", "charged, 99 % [ms]", "whole step, median [ms]", "whole step, 99 % [ms]", "budget kept",
                      "real time kept", "open pairs", "leaf contacts", "level reached"},
                     times) +
           "<h2>What it cost in accuracy</h2>\n" +
           part_html(table,
                     {"missed contacts", "unseen of these", "false contacts", "depth error, RMS [mm]", "force error", "a step: surface RMS [mm]", "a step: Hausdorff [mm]",
                      "trajectory: RMS [mm]", "trajectory: Hausdorff [mm]"},
                     errors);
}

/// The first sentence: the cheapest budget that gave up nothing that matters, or what the tightest one cost.
std::string headline(const CostTable& table) {
    if (table.steps > 0 && !table.touched())
        return fmt::format("Nothing touched in {}: no budget had anything to lose", count_text(table.steps, "step", "steps"));
    const CostRow* cheapest = nullptr;
    for (const CostRow& row : table.rows) {
        if (!row.variant.empty()) continue;
        const bool exact = row.steps > 0 && row.contacts.missed == 0 && row.contacts.spurious == 0 && row.trajectory.hausdorff == 0.0;
        if (exact && row.budget.limits.mode != BudgetMode::Exact && (cheapest == nullptr || row.charged_ms.p50 < cheapest->charged_ms.p50))
            cheapest = &row;
    }
    if (cheapest != nullptr) return fmt::format("{} a step is enough: its run equals the exact one to the last bit", cheapest->name());
    const auto own_end =
        table.rows.begin() + static_cast<std::ptrdiff_t>(
                                 std::count_if(table.rows.begin(), table.rows.end(), [](const CostRow& r) { return r.variant.empty(); }));
    const auto worst = std::max_element(table.rows.begin(), own_end,
                                        [](const CostRow& a, const CostRow& b) { return a.trajectory.hausdorff < b.trajectory.hausdorff; });
    if (worst == own_end || !(worst->trajectory.hausdorff > 0.0)) return "All runs equal the exact one to the last bit";
    return fmt::format("Under {} a step the run diverges by up to {} mm from the exact run", worst->name(),
                       number_text(1e3 * worst->trajectory.hausdorff));
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
        "<h2>How it was measured</h2>\n<p><b>One step.</b> Contacts, depths, forces and surfaces: in every step of the exact run each budget answers "
        "from the exact run's state. Surfaces are compared at {0} instants, an instrument's at the end of the step, tissue's one step later, when "
        "the answer has moved it. Distances are from each vertex to the nearest point of the other surface, in both directions.</p>\n"
        "<p><b>Runs.</b> Times, trajectories and tips: each budget makes a run of its own, which is compared with the exact run at the same instants. "
        "The budget pays for {5}; times are given for that and for the whole step.</p>\n"
        "<p><b>Contacts.</b> A contact is a patch of a surface in a step, a cell of {1}. Solids touch where their spheres come within {2} mm; pairs that "
        "the budget left open count as contacts, as in the response. An instrument touches where the wall presses on it. Depth errors are over "
        "all patches that any of the compared answers has as a contact in that step, the same for every budget. A variant with other sphere trees than "
        "the scene's is compared with the surfaces themselves, since the exact answer refers to the leaves of its own tree.</p>\n"
        "<p class=\"soft\">The exact run's contact force is {3} N (root mean square over steps and bodies). An independent search found {4} patches of "
        "solids within the tolerance; {6} of them had no contact of the exact traversal, and in the others the spheres' depth differed from that of the "
        "surfaces by {7} mm (root mean square).</p>\n",
        table.compared_states, patches, number_text(1e3 * table.tolerance_m), number_text(table.force_rms_n), table.near_patches,
        scope_text(scene.budget), table.near_uncovered, number_text(1e3 * table.near_depth_rms_m));
}

} // namespace

std::string cost_page(const Scene& scene, CostTable& table, std::span<const CostPicture> pictures) {
    const std::string plots = cost_plots(scene, table);
    std::string page =
        fmt::format("<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
                    "content=\"width=device-width,initial-scale=1\">\n"
                    "<title>The price of accuracy: {0}</title>\n<style>{1}</style></head>\n<body><main>\n<p class=\"over\">{0}: the price "
                    "of accuracy</p>\n"
                    "<div class=\"verdict note\"><h1>{2}</h1>\n<p class=\"lead\">{3} under {4}, each against the exact run{5}.</p></div>\n",
                    escape_html(scene.name), kReportStyle, escape_html(headline(table)),
                    count_text(table.steps, "step", "steps") + start_text(table, scene.time.step),
                    count_text(table.rows.size(), "budget", "budgets"),
                    has_variants(table) ? ", as the scene says and answered other ways; curves over time are the scene's own" : "");
    page += table_html(table);
    if (!table.notices.empty()) {
        page += "<div class=\"notices\">";
        for (const std::string& notice : table.notices) page += fmt::format("<div>{}</div>", escape_html(notice));
        page += "</div>\n";
    }
    page += "<h2>Over budgets and time</h2>\n" + plots + pictures_html(pictures) + how_measured(scene, table);
    page += fmt::format("<h2>To repeat it</h2>\n<pre>{}</pre>\n<dl><dt>Scene</dt><dd>{}</dd><dt>Scene's hash</dt><dd><code>{:016x}</code>, as it was "
                        "prepared</dd>{}</dl>\n<footer>The numbers of this page are in cost.csv and cost.json.</footer>\n</main></body></html>\n",
                        escape_html(cost_command_text(scene, table)), escape_html(project_path(scene.file)), table.model_hash, facts_html(describe_machine()));
    return page;
}

} // namespace trocar::engine
