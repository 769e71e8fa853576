#include "engine/experiments/cost_page.hpp"
#include "engine/report/places.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <iterator>

namespace trocar::engine {

namespace {

using Json = nlohmann::ordered_json;

/// A cell for RFC 4180 where it needs quoting.
std::string csv_text(const std::string& text) {
    if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
    std::string quoted = "\"";
    for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
    return quoted + "\"";
}

Json percentiles(const Percentiles& p) { return {{"p50", p.p50}, {"p95", p.p95}, {"p99", p.p99}, {"max", p.max}}; }

Json row_json(const CostRow& row) {
    Json json{{"budget", row.budget.name},
              {"variant", row.variant},
              {"mode", mode_name(row.budget.limits.mode)},
              {"steps", row.steps},
              {"step_ms", percentiles(row.step_ms)},
              {"charged_ms", percentiles(row.charged_ms)},
              {"budget_kept", row.budget_kept},
              {"realtime_kept", row.realtime_kept},
              {"exact_steps", row.exact_steps},
              {"dropped_steps", row.dropped_steps},
              {"lumen_exits", row.lumen_exits},
              {"pairs_open_mean", row.pairs_open_mean},
              {"leaf_contacts_mean", row.leaf_contacts_mean},
              {"assumed_mean", row.assumed_mean},
              {"level_reached_mean", row.level_reached_mean},
              {"reference_contacts", row.contacts.reference},
              {"missed_contacts", row.contacts.missed},
              {"false_contacts", row.contacts.spurious},
              {"depth_error_rms_m", row.depth_error_rms_m()},
              {"force_error_rel", row.force_error_rel},
              {"surface_rms_m", row.surface.rms()},
              {"surface_hausdorff_m", row.surface.hausdorff},
              {"trajectory_rms_m", row.trajectory.rms()},
              {"trajectory_hausdorff_m", row.trajectory.hausdorff},
              {"tip_distance_rms_m", row.tip_distance_rms_m},
              {"tip_distance_max_m", row.tip_distance_max_m},
              {"state_hash", row.state_hash},
              {"failure", row.failure}};
    Json curve = Json::array();
    for (const CostPoint& p : row.curve) curve.push_back({p.time_s, p.level, p.pairs_open, p.tip_distance_m, p.step_ms, p.charged_ms});
    json["curve_columns"] = {"time_s", "level_reached_min", "pairs_open_max", "tip_distance_max_m", "step_ms_max", "charged_ms_max"};
    json["curve"] = std::move(curve);
    return json;
}

} // namespace

std::string cost_csv(const CostTable& table) {
    const bool variants = std::any_of(table.rows.begin(), table.rows.end(), [](const CostRow& row) { return !row.variant.empty(); });
    std::string text = fmt::format("budget,step_ms_p50,step_ms_p99,budget_kept,pairs_open_mean,leaf_contacts_mean,level_reached_mean,"
                                   "missed_contacts,false_contacts,depth_error_rms_m,force_error_rel,surface_rms_m,surface_hausdorff_m,"
                                   "charged_ms_p50,charged_ms_p99,realtime_kept,trajectory_rms_m,trajectory_hausdorff_m{}\n",
                                   variants ? ",variant" : "");
    for (const CostRow& row : table.rows)
        fmt::format_to(std::back_inserter(text), "{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}{}\n", csv_text(row.budget.name),
                       row.step_ms.p50, row.step_ms.p99, row.budget_kept, row.pairs_open_mean, row.leaf_contacts_mean,
                       row.level_reached_mean, row.contacts.missed, row.contacts.spurious, row.depth_error_rms_m(), row.force_error_rel,
                       row.surface.rms(), row.surface.hausdorff, row.charged_ms.p50, row.charged_ms.p99, row.realtime_kept,
                       row.trajectory.rms(), row.trajectory.hausdorff, variants ? "," + row.variant : "");
    return text;
}

std::string cost_json(const Scene& scene, const CostTable& table) {
    Json json;
    json["scene"] = project_path(scene.file);
    json["steps"] = table.steps;
    json["interrupted"] = table.interrupted;
    json["tolerance_m"] = table.tolerance_m;
    for (std::size_t i = 0; i < table.patch_m.size(); ++i) json["patch_m"][scene.bodies[i].name] = table.patch_m[i];
    json["budget_scope"] = scene.budget.scope == BudgetScope::Step ? "step" : "collision";
    json["compared_states"] = table.compared_states;
    if (table.floor_ms >= 0.0) json["floor_ms"] = table.floor_ms;
    json["near_patches"] = table.near_patches;
    json["near_uncovered"] = table.near_uncovered;
    json["near_depth_rms_m"] = table.near_depth_rms_m;
    json["exact_force_rms_n"] = table.force_rms_n;
    json["rows"] = Json::array();
    for (const CostRow& row : table.rows) json["rows"].push_back(row_json(row));
    json["notices"] = table.notices;
    const Machine machine = describe_machine();
    json["machine"] = {{"processor", machine.processor},
                       {"cores", machine.cores},
                       {"memory_gib", machine.memory_gib},
                       {"system", machine.system},
                       {"compiler", machine.compiler}};
    return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string cost_text(const CostTable& table) {
    std::size_t width = 12;
    for (const CostRow& row : table.rows) width = std::max(width, row.name().size());
    std::string text =
        fmt::format("{:<{}} {:>9} {:>9} {:>9} {:>7} {:>9} {:>9} {:>6} {:>8} {:>8} {:>10} {:>9} {:>10} {:>10} {:>11} {:>11}\n", "budget",
                    width, "charged", "step p50", "step p99", "kept", "open", "leaves", "level", "missed", "false", "depth [mm]", "force",
                    "rms [mm]", "Hausd [mm]", "path rms", "path Hausd");
    for (const CostRow& row : table.rows)
        fmt::format_to(std::back_inserter(text),
                       "{:<{}} {:>9.3g} {:>9.3g} {:>9.3g} {:>6.2f}% {:>9.4g} {:>9.4g} {:>6.2f} {:>8} {:>8} {:>10.3g} {:>9.3g} {:>10.3g} "
                       "{:>10.3g} {:>11.3g} {:>11.3g}\n",
                       row.name(), width, row.charged_ms.p50, row.step_ms.p50, row.step_ms.p99, 100.0 * row.budget_kept,
                       row.pairs_open_mean, row.leaf_contacts_mean, row.level_reached_mean, row.contacts.missed, row.contacts.spurious,
                       1e3 * row.depth_error_rms_m(), row.force_error_rel, 1e3 * row.surface.rms(), 1e3 * row.surface.hausdorff,
                       1e3 * row.trajectory.rms(), 1e3 * row.trajectory.hausdorff);
    return text + "times in ms (charged: median of what the budget's scope took); depth, rms, Hausd: of a step from the exact run's state; "
                  "path: where the run by itself diverged to, mm\n";
}

} // namespace trocar::engine
