#include "engine/experiments/cost_page.hpp"
#include "engine/report/build_facts.hpp"
#include "engine/report/places.hpp"
#include "engine/report/statistics.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <iterator>

namespace trocar::engine {

std::string cost_command_text(const Scene& scene, const CostTable& table) {
    std::string budgets;
    for (const CostRow& row : table.rows)
        if (row.variant.empty()) budgets += (budgets.empty() ? "" : ",") + row.budget.name;
    std::string command = fmt::format("trocar cost {} --budgets {} -n {}", shell_quoted(project_path(scene.file)), shell_quoted(budgets), table.steps);
    if (table.from > 0 || scene.cost.from > 0.0) command += fmt::format(" --from {}", static_cast<double>(table.from) * scene.time.step);
    for (const std::string& setting : scene.settings) command += setting.starts_with("--") ? " " + setting : " --set " + shell_quoted(setting);
    std::vector<std::string> variants;
    for (const CostRow& row : table.rows)
        if (!row.variant.empty() && std::find(variants.begin(), variants.end(), row.variant) == variants.end()) variants.push_back(row.variant);
    for (std::size_t i = 0; i < variants.size(); ++i) command += (i == 0 ? " --variants " : ",") + variants[i];
    return command + " --out repeated";
}

namespace {

using Json = OutputJson;

/// A cell for RFC 4180 where it needs quoting.
std::string csv_text(const std::string& text) {
    if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
    std::string quoted = "\"";
    for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
    return quoted + "\"";
}

Json percentiles(const Percentiles& p) { return {{"p50", p.p50}, {"p95", p.p95}, {"p99", p.p99}, {"max", p.max}}; }

Json curve_json(const CostRow& row) {
    Json curve = Json::array();
    for (const CostPoint& p : row.curve) curve.push_back({p.time_s, p.level, p.pairs_open, p.tip_distance_m, p.step_ms, p.charged_ms});
    return curve;
}

struct CostItem {
    const Scene& scene;
    const CostTable& table;
};

#define TROCAR_COST_KEY(Item, name, unit, meaning, value)                                                                                  \
    JsonKey<Item> {                                                                                                                        \
        {name, unit, meaning}, []([[maybe_unused]] const Item& r) -> Json { return value; }                                                               \
    }
#define TROCAR_ROW_KEY(name, unit, meaning, value) TROCAR_COST_KEY(CostRow, name, unit, meaning, value)
#define TROCAR_FILE_KEY(name, unit, meaning, value) TROCAR_COST_KEY(CostItem, name, unit, meaning, value)

const JsonKey<CostRow> kRowKeys[] = {
    TROCAR_ROW_KEY("budget", "", "As it was asked for.", r.budget.name),
    TROCAR_ROW_KEY("variant", "", "Another way to answer contacts (`--variants`); empty: as the scene says.", r.variant),
    TROCAR_ROW_KEY("mode", "", "`wall`, `work` or `exact`.", mode_name(r.budget.limits.mode)),
    TROCAR_ROW_KEY("steps", "", "Steps that were taken under this budget.", r.steps),
    TROCAR_ROW_KEY("step_ms", "ms", "Wall time of a whole step: `p50`, `p95`, `p99`, `max`.", percentiles(r.step_ms)),
    TROCAR_ROW_KEY("charged_ms", "ms", "Wall time charged to the budget: `p50`, `p95`, `p99`, `max`.", percentiles(r.charged_ms)),
    TROCAR_ROW_KEY("budget_kept", "[-]", "Share of steps within the budget.", r.budget_kept),
    TROCAR_ROW_KEY("realtime_kept", "[-]", "Share of whole steps within the time they simulate.", r.realtime_kept),
    TROCAR_ROW_KEY("exact_steps", "", "Steps whose answer the exact stage gave.", r.exact_steps),
    TROCAR_ROW_KEY("dropped_steps", "", "Steps that left an effect out.", r.dropped_steps),
    TROCAR_ROW_KEY("lumen_exits", "", "Instrument vertices outside the lumen, over all steps.", r.lumen_exits),
    TROCAR_ROW_KEY("pairs_open_mean", "", "Sphere pairs that the budget left open, mean over steps.", r.pairs_open_mean),
    TROCAR_ROW_KEY("leaf_contacts_mean", "", "Pairs of leaf spheres in contact, mean over steps.", r.leaf_contacts_mean),
    TROCAR_ROW_KEY("assumed_mean", "", "Untested pairs that counted as contacts, mean over steps.", r.assumed_mean),
    TROCAR_ROW_KEY("level_reached_mean", "", "Coarsest level still open, mean over steps.", r.level_reached_mean),
    TROCAR_ROW_KEY("reference_contacts", "", "Contacts of the exact answer: (surface patch, step).", r.contacts.reference),
    TROCAR_ROW_KEY("missed_contacts", "", "Contacts of the exact answer that this one lacks.", r.contacts.missed),
    TROCAR_ROW_KEY("unseen_contacts", "",
                   "Those of the missed, between solids, whose surfaces are near in this answer too, by a search without trees of spheres. The others are "
                   "apart in it: a solver that ended early leaves other positions.",
                   r.contacts.unseen),
    TROCAR_ROW_KEY("false_contacts", "", "Contacts of this answer that the exact one lacks.", r.contacts.spurious),
    TROCAR_ROW_KEY("depth_error_rms_m", "m", "Error of the penetration depth, root mean square over patches in contact.", r.depth_error_rms_m()),
    TROCAR_ROW_KEY("force_error_rel", "[-]", "Error of the contact forces over the exact ones, root of summed squares.", r.force_error_rel),
    TROCAR_ROW_KEY("surface_rms_m", "m", "Distance of the surfaces from the exact run's after a step from the same state, root mean square.", r.surface.rms()),
    TROCAR_ROW_KEY("surface_hausdorff_m", "m", "The same, largest.", r.surface.hausdorff),
    TROCAR_ROW_KEY("trajectory_rms_m", "m", "Distance of the surfaces of a run by itself from the exact run's, root mean square.", r.trajectory.rms()),
    TROCAR_ROW_KEY("trajectory_hausdorff_m", "m", "The same, largest.", r.trajectory.hausdorff),
    TROCAR_ROW_KEY("tip_distance_rms_m", "m", "Distance of the tip from the exact run's, root mean square.", r.tip_distance_rms_m),
    TROCAR_ROW_KEY("tip_distance_max_m", "m", "The same, largest.", r.tip_distance_max_m),
    TROCAR_ROW_KEY("state_hash", "", "Hash of the final state.", r.state_hash),
    TROCAR_ROW_KEY("failure", "", "Why the run was stopped; else empty.", r.failure),
    TROCAR_ROW_KEY("curve_columns", "", "Names of the columns of `curve`.",
                   (Json{"time_s", "level_reached_min", "pairs_open_max", "tip_distance_max_m", "step_ms_max", "charged_ms_max"})),
    TROCAR_ROW_KEY("curve", "", "Rows of numbers over the run, at most 400.", curve_json(r)),
};

Json patches_json(const CostItem& r) {
    Json json = Json::object();
    for (std::size_t i = 0; i < r.table.patch_m.size(); ++i) json[r.scene.bodies[i].name] = r.table.patch_m[i];
    return json;
}

Json rows_json(const CostTable& table) {
    Json rows = Json::array();
    for (const CostRow& row : table.rows) rows.push_back(write_keys<CostRow>(kRowKeys, row));
    return rows;
}

Json machine_json() {
    const Machine machine = describe_machine();
    return {{"processor", machine.processor},
            {"cores", machine.cores},
            {"memory_gib", machine.memory_gib},
            {"system", machine.system},
            {"compiler", machine.compiler}};
}

const JsonKey<CostItem> kFileKeys[] = {
    TROCAR_FILE_KEY("scene", "", "The scene's file, relative to its project.", project_path(r.scene.file)),
    TROCAR_FILE_KEY("model_hash", "", "Hash of the prepared scene, hexadecimal: another scene, mesh or preparation has another.", fmt::format("{:016x}", r.table.model_hash)),
    TROCAR_FILE_KEY("steps", "", "Steps of the exact run that are compared.", r.table.steps),
    TROCAR_FILE_KEY("from", "", "Steps that it had taken before the first of them.", r.table.from),
    TROCAR_FILE_KEY("interrupted", "", "true: ended by a request.", r.table.interrupted),
    TROCAR_FILE_KEY("tolerance_m", "m", "Within which solids count as touching.", r.table.tolerance_m),
    TROCAR_FILE_KEY("patch_m", "m", "Size of a surface patch, by body.", patches_json(r)),
    TROCAR_FILE_KEY("budget_scope", "", "What the budgets cover: `collision` or `step`.",
                    r.scene.budget.scope == BudgetScope::Step ? "step" : "collision"),
    TROCAR_FILE_KEY("compared_states", "", "Instants at which surfaces were compared.", r.table.compared_states),
    TROCAR_FILE_KEY("floor_ms", "ms", "Charged under a budget of nothing, where the exact run touched most.",
                    r.table.floor_ms >= 0.0 ? Json(r.table.floor_ms) : left_out()),
    TROCAR_FILE_KEY("near_patches", "", "(patch, step) of solids within the tolerance, by an independent search.", r.table.near_patches),
    TROCAR_FILE_KEY("near_uncovered", "", "Of them beneath no contact of the exact traversal.", r.table.near_uncovered),
    TROCAR_FILE_KEY("near_depth_rms_m", "m", "Depth of the leaf spheres against that of the surfaces, root mean square.", r.table.near_depth_rms_m),
    TROCAR_FILE_KEY("exact_force_rms_n", "N", "Contact force of the exact run, root mean square over steps and bodies.", r.table.force_rms_n),
    TROCAR_FILE_KEY("rows", "", "A list, below.", rows_json(r.table)),
    TROCAR_FILE_KEY("notices", "", "Sentences that were printed.", r.table.notices),
    TROCAR_FILE_KEY("version", "", "Of the program.", build_facts().version),
    TROCAR_FILE_KEY("commit", "", "Of the sources that it was built from.", build_facts().commit),
    TROCAR_FILE_KEY("machine", "", "`processor`, `cores`, `memory_gib`, `system`, `compiler`.", machine_json()),
    TROCAR_FILE_KEY("command", "", "What repeats the measurement.", cost_command_text(r.scene, r.table)),
};
#undef TROCAR_FILE_KEY
#undef TROCAR_ROW_KEY
#undef TROCAR_COST_KEY

template <class Number>
std::string number(Number value) {
    return fmt::format("{}", value);
}

/// A column of cost.csv. The last one is there with variants alone.
struct CostColumn {
    OutputKey key;
    std::string (*value)(const CostRow&);
};
#define TROCAR_COST_COLUMN(name, unit, meaning, value)                                                                                     \
    {                                                                                                                                      \
        {name, unit, meaning}, [](const CostRow& r) -> std::string { return value; }                                                       \
    }
constexpr CostColumn kCostColumns[] = {
    TROCAR_COST_COLUMN("budget", "", "As it was asked for.", csv_text(r.budget.name)),
    TROCAR_COST_COLUMN("step_ms_p50", "ms", "Wall time of a whole step, median.", number(r.step_ms.p50)),
    TROCAR_COST_COLUMN("step_ms_p99", "ms", "The same, 99th percentile.", number(r.step_ms.p99)),
    TROCAR_COST_COLUMN("budget_kept", "[-]", "Share of steps within the budget.", number(r.budget_kept)),
    TROCAR_COST_COLUMN("pairs_open_mean", "", "Sphere pairs that the budget left open, mean over steps.", number(r.pairs_open_mean)),
    TROCAR_COST_COLUMN("leaf_contacts_mean", "", "Pairs of leaf spheres in contact, mean over steps.", number(r.leaf_contacts_mean)),
    TROCAR_COST_COLUMN("level_reached_mean", "", "Coarsest level still open, mean over steps.", number(r.level_reached_mean)),
    TROCAR_COST_COLUMN("missed_contacts", "", "Contacts of the exact answer, (surface patch, step), that this one lacks.", number(r.contacts.missed)),
    TROCAR_COST_COLUMN("false_contacts", "", "Contacts of this answer that the exact one lacks.", number(r.contacts.spurious)),
    TROCAR_COST_COLUMN("depth_error_rms_m", "m", "Error of the penetration depth, root mean square.", number(r.depth_error_rms_m())),
    TROCAR_COST_COLUMN("force_error_rel", "[-]", "Error of the contact forces over the exact ones.", number(r.force_error_rel)),
    TROCAR_COST_COLUMN("surface_rms_m", "m", "Distance of the surfaces from the exact run's after a step from the same state, root mean square.", number(r.surface.rms())),
    TROCAR_COST_COLUMN("surface_hausdorff_m", "m", "The same, largest.", number(r.surface.hausdorff)),
    TROCAR_COST_COLUMN("charged_ms_p50", "ms", "Wall time charged to the budget, median.", number(r.charged_ms.p50)),
    TROCAR_COST_COLUMN("charged_ms_p99", "ms", "The same, 99th percentile.", number(r.charged_ms.p99)),
    TROCAR_COST_COLUMN("realtime_kept", "[-]", "Share of whole steps within the time they simulate.", number(r.realtime_kept)),
    TROCAR_COST_COLUMN("trajectory_rms_m", "m", "Distance of the surfaces of a run by itself from the exact run's, root mean square.", number(r.trajectory.rms())),
    TROCAR_COST_COLUMN("trajectory_hausdorff_m", "m", "The same, largest.", number(r.trajectory.hausdorff)),
    TROCAR_COST_COLUMN("unseen_contacts", "",
                       "Those of the missed, between solids, whose surfaces are near in this answer too, by an independent search.", number(r.contacts.unseen)),
    TROCAR_COST_COLUMN("variant", "", "With `--variants` alone: the way contacts were answered; empty: as the scene says.", r.variant),
};
#undef TROCAR_COST_COLUMN

} // namespace

std::string cost_csv(const CostTable& table) {
    const bool variants = std::any_of(table.rows.begin(), table.rows.end(), [](const CostRow& row) { return !row.variant.empty(); });
    const std::span columns(kCostColumns, std::size(kCostColumns) - (variants ? 0 : 1));
    std::string text;
    for (const CostColumn& column : columns) text.append(text.empty() ? "" : ",").append(column.key.name);
    text += '\n';
    for (const CostRow& row : table.rows) {
        for (const CostColumn& column : columns) text += column.value(row) + ",";
        text.back() = '\n';
    }
    return text;
}

std::string cost_json(const Scene& scene, const CostTable& table) {
    return write_keys<CostItem>(kFileKeys, CostItem{scene, table}).dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::vector<OutputTable> cost_output_tables() {
    std::vector<OutputKey> columns;
    for (const CostColumn& column : kCostColumns) columns.push_back(column.key);
    return {{"cost.csv", "A row for each budget.", std::move(columns)},
            {"cost.json", "", keys_of<CostItem>(kFileKeys)},
            {"cost.json: rows", "One object for each budget, and for each variant again.", keys_of<CostRow>(kRowKeys)}};
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
                       row.name(), width, row.charged_ms.p50, row.step_ms.p50, row.step_ms.p99, percent_of(row.budget_kept),
                       row.pairs_open_mean, row.leaf_contacts_mean, row.level_reached_mean, row.contacts.missed, row.contacts.spurious,
                       1e3 * row.depth_error_rms_m(), row.force_error_rel, 1e3 * row.surface.rms(), 1e3 * row.surface.hausdorff,
                       1e3 * row.trajectory.rms(), 1e3 * row.trajectory.hausdorff);
    return text + "times in ms (charged: median of what the budget's scope took); depth, rms, Hausd: of a step from the exact run's state; "
                  "path: where the run by itself diverged to, mm\n";
}

} // namespace trocar::engine
