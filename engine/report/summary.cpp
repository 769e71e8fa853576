#include "engine/report/summary.hpp"

#include "engine/report/build_facts.hpp"
#include "engine/report/xray_frames.hpp"
#include "engine/step/model_hash.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace trocar::engine {

namespace {

using Json = OutputJson;

Json percentiles(const Percentiles& p) { return {{"p50", p.p50}, {"p95", p.p95}, {"p99", p.p99}, {"max", p.max}}; }

Json stages(const std::array<double, kStageCount>& p50) {
    Json json = Json::object();
    for (std::size_t i = 0; i < kStageCount; ++i) json[kStageNames[i]] = p50[i];
    return json;
}

const char* motion_name(const BodyModel& body) {
    if (body.motion == Motion::Deformable) return "deformable";
    return body.motion == Motion::Kinematic ? "kinematic" : "static";
}

struct BodyItem {
    const BodySummary& summary;
    const BodyModel& model;
};
struct InstrumentItem {
    const InstrumentModel& instrument;
    const SceneModel& model;
};

#define TROCAR_KEY(Item, name, unit, meaning, value)                                                                                       \
    JsonKey<Item> {                                                                                                                        \
        {name, unit, meaning}, []([[maybe_unused]] const Item& r) -> Json { return value; }                                                               \
    }
#define TROCAR_BODY_KEY(name, unit, meaning, value) TROCAR_KEY(BodyItem, name, unit, meaning, value)
#define TROCAR_INSTRUMENT_KEY(name, unit, meaning, value) TROCAR_KEY(InstrumentItem, name, unit, meaning, value)
#define TROCAR_SUMMARY_KEY(name, unit, meaning, value) TROCAR_KEY(RunRecord, name, unit, meaning, value)

const JsonKey<BodyItem> kBodyKeys[] = {
    TROCAR_BODY_KEY("name", "", "Of the body in the scene.", r.summary.name),
    TROCAR_BODY_KEY("motion", "", "`deformable`, `kinematic` (moved by the scene) or `static`.", motion_name(r.model)),
    TROCAR_BODY_KEY("hollow", "", "true: a lumen.", r.model.hollow),
    TROCAR_BODY_KEY("vertices", "", "Of the dense surface.", r.summary.vertices),
    TROCAR_BODY_KEY("triangles", "", "Of the dense surface.", r.summary.triangles),
    TROCAR_BODY_KEY("coarse_nodes", "", "Of the tetrahedral mesh that is integrated.", r.summary.coarse_nodes),
    TROCAR_BODY_KEY("coarse_tets", "", "Of the tetrahedral mesh that is integrated.", r.summary.coarse_tets),
    TROCAR_BODY_KEY("pinned_nodes", "", "Nodes that are held.", r.summary.pinned_nodes),
    TROCAR_BODY_KEY("stable_step_s", "s", "Stable sub-step at rest.", r.summary.stable_step_s),
    TROCAR_BODY_KEY("links", "", "Vertices of the dense surface that are linked to the mesh.", r.summary.links),
    TROCAR_BODY_KEY("static_links", "", "Of them to held nodes alone.", r.summary.static_links),
    TROCAR_BODY_KEY("degenerate_links", "", "Of them to a triangle without area.", r.summary.degenerate_links),
    TROCAR_BODY_KEY("longest_link_m", "m", "Largest distance from a vertex to its place on the mesh.", r.summary.longest_link_m),
    TROCAR_BODY_KEY("tree_spheres", "", "Spheres of its tree.", r.summary.tree_spheres),
    TROCAR_BODY_KEY("free_balls", "", "Inscribed spheres of its lumen.", r.summary.inscribed_spheres),
    TROCAR_BODY_KEY("notes", "", "What was noticed while it was prepared.", r.summary.notes),
};

const JsonKey<InstrumentItem> kInstrumentKeys[] = {
    TROCAR_INSTRUMENT_KEY("name", "", "Of the instrument in the scene.", r.instrument.name),
    TROCAR_INSTRUMENT_KEY("rod_nodes", "", "Nodes of the rod.", r.instrument.rod.node_count()),
    TROCAR_INSTRUMENT_KEY("length_m", "m", "Length of the rod.", r.instrument.rod.design.length),
    TROCAR_INSTRUMENT_KEY("radius_m", "m", "Radius of the rod.", r.instrument.rod.design.radius),
    TROCAR_INSTRUMENT_KEY("skin_triangles", "", "Triangles of its surface.", r.instrument.skin.triangles.size()),
    TROCAR_INSTRUMENT_KEY("lumen", "", "Name of the body that it is in.", r.model.bodies[r.instrument.lumen].name),
    TROCAR_INSTRUMENT_KEY("kind", "", "`rod`, or `mass_spring`.", r.instrument.mass_spring_substeps > 0 ? "mass_spring" : "rod"),
    TROCAR_INSTRUMENT_KEY("substeps", "", "Of a `mass_spring` in a step.",
                          r.instrument.mass_spring_substeps > 0 ? Json(r.instrument.mass_spring_substeps) : left_out()),
    TROCAR_INSTRUMENT_KEY("inside", "", "The instrument that it runs in.",
                          r.instrument.inside ? Json(r.model.instruments[*r.instrument.inside].name) : left_out()),
    TROCAR_INSTRUMENT_KEY("route_m", "m", "Length of the route that it is driven along.",
                          r.instrument.route ? Json(r.instrument.route->length.back()) : left_out()),
};

Json bodies(const PreparedScene& prepared) {
    Json list = Json::array();
    for (std::size_t i = 0; i < prepared.bodies.size(); ++i)
        list.push_back(write_keys<BodyItem>(kBodyKeys, BodyItem{prepared.bodies[i], prepared.model.bodies[i]}));
    return list;
}

Json instruments(const SceneModel& model) {
    Json list = Json::array();
    for (const InstrumentModel& instrument : model.instruments)
        list.push_back(write_keys<InstrumentItem>(kInstrumentKeys, InstrumentItem{instrument, model}));
    return list;
}

/// "free": no step waited, and none could be late.
Json pace(const RunSummary& s) {
    if (!s.pace) return "free";
    const PaceStats& stats = s.pace_stats;
    return {{"speed", s.pace->speed},
            {"late", s.pace->late == LatePolicy::CatchUp ? "catch_up" : "slow_motion"},
            {"late_steps", stats.late_steps},
            {"worst_late_ms", 1e-6 * static_cast<double>(stats.worst_late_ns)},
            {"slow_motion_s", 1e-9 * static_cast<double>(stats.lost_ns)},
            {"waited_s", 1e-9 * static_cast<double>(stats.waited_ns)}};
}

Json effect_calls(const EffectCounts& counts) {
    Json json;
    for (const EffectDescriptor* effect : registered_effects())
        if (effect->in_step) json[std::string(effect->name)] = counts.of(*effect);
    return json;
}

/// The value in a run with instruments, and no key in another.
template <class Value>
Json of_instruments(const RunRecord& record, const Value& value) {
    return record.prepared.model.instruments.empty() ? left_out() : Json(value);
}

template <class Value>
Json of_self_contact(const RunRecord& record, const Value& value) {
    return record.prepared.model.effects.self_contact ? of_instruments(record, value) : left_out();
}

/// Has one of the instruments play in another one's bore?
bool any_has_play(const RunRecord& record) {
    const std::vector<InstrumentModel>& all = record.prepared.model.instruments;
    return std::any_of(all.begin(), all.end(), has_play);
}

template <class Value>
Json of_instrument_contact(const RunRecord& record, const Value& value) {
    return record.prepared.model.effects.instrument_contact || any_has_play(record) ? of_instruments(record, value) : left_out();
}

/// The value where it is no stand-in for "none".
template <class Value>
Json where(bool known, const Value& value) {
    return known ? Json(value) : left_out();
}

Json target_distance(const RunStatistics& t) { return {{"last", t.target_distance_m}, {"min", t.closest_target_m}}; }

const JsonKey<RunRecord> kSummaryKeys[] = {
    // what scripts rely on, in this order
    TROCAR_SUMMARY_KEY("scene", "", "The scene's file, relative to its project.", project_path(r.scene.file)),
    TROCAR_SUMMARY_KEY("steps", "", "Steps that were taken.", r.summary.steps),
    TROCAR_SUMMARY_KEY("mode", "", "Of the budget: `wall`, `work` or `exact`.", mode_name(r.scene.budget.limits.mode)),
    TROCAR_SUMMARY_KEY("budget", "", "As `--budget` takes it.", r.scene.budget.to_string()),
    TROCAR_SUMMARY_KEY("budget_scope", "", "What the budget covers: `collision` or `step`.",
                       r.scene.budget.scope == BudgetScope::Step ? "step" : "collision"),
    TROCAR_SUMMARY_KEY("simulated_s", "s", "Simulated time.", r.summary.simulated_s),
    TROCAR_SUMMARY_KEY("wall_s", "s", "Wall time of the steps, without observation.", r.summary.wall_s),
    TROCAR_SUMMARY_KEY("realtime_factor", "[-]", "simulated_s over wall_s: more than 1 is faster than real time.", r.summary.realtime_factor),
    TROCAR_SUMMARY_KEY("step_ms", "ms", "Wall time of a whole step: `p50`, `p95`, `p99`, `max`.", percentiles(r.summary.step_ms)),
    TROCAR_SUMMARY_KEY("collision_ms", "ms", "Wall time of collision detection in a step: `p50`, `p95`, `p99`, `max`.", percentiles(r.summary.collision_ms)),
    TROCAR_SUMMARY_KEY("budget_kept", "[-]", "Share of steps whose budgeted part ended within the budget.", r.summary.budget_kept),
    TROCAR_SUMMARY_KEY("realtime_kept", "[-]", "Share of whole steps that ended within the time they simulate.", r.summary.realtime_kept),
    TROCAR_SUMMARY_KEY("worst_overrun_ms", "ms", "Longest overrun of the budget.", r.summary.worst_overrun_ms),
    TROCAR_SUMMARY_KEY("substeps", "", "Most sub-steps of the tissue in a step.", r.statistics.substeps),
    TROCAR_SUMMARY_KEY("stable_step_s", "s", "Smallest stable sub-step; 0: no deformable body.", r.statistics.stable_step_s),
    TROCAR_SUMMARY_KEY("min_volume_ratio", "[-]", "Smallest volume of a tetrahedron over its volume at rest.", r.statistics.min_volume_ratio),
    TROCAR_SUMMARY_KEY("inverted_tets_max", "", "Most inverted tetrahedra in a step.", r.statistics.inverted_tets),
    TROCAR_SUMMARY_KEY("exact_steps", "", "Steps whose answer the exact stage gave.", r.summary.exact_steps),
    TROCAR_SUMMARY_KEY("contacts_total", "", "Contacts that the response pushed against, over all steps.", r.summary.contacts),
    TROCAR_SUMMARY_KEY("unresolved_total", "", "Continuous tests without a verdict, over all steps.", r.summary.unresolved),
    TROCAR_SUMMARY_KEY("assumed_total", "", "Untested sphere pairs that counted as contacts, over all steps.", r.summary.assumed),
    TROCAR_SUMMARY_KEY("lumen_exits", "", "Instrument vertices outside the lumen at the end of a step, over all steps.", r.summary.lumen_exits),
    TROCAR_SUMMARY_KEY("energy_j", "J", "Kinetic and elastic energy: `first`, `last`, `max`.",
                       (Json{{"first", r.statistics.energy.first}, {"last", r.statistics.energy.last}, {"max", r.statistics.energy.max}})),
    TROCAR_SUMMARY_KEY("stages_ms", "ms", "Median wall time of each stage, by name.", stages(r.stage_p50)),
    TROCAR_SUMMARY_KEY("effects", "", "Names of the effects that were simulated.", r.scene.effects.names()),
    TROCAR_SUMMARY_KEY("state_hash", "", "Hash of the final state, hexadecimal: equal hashes are equal bits.", r.summary.state_hash),
    // what was given up
    TROCAR_SUMMARY_KEY("pace", "",
                       "`free`, or of a run at the clock's pace: `speed`, `late` (policy), `late_steps`, `worst_late_ms`, `slow_motion_s` (how far "
                       "it fell behind real time), `waited_s`.",
                       pace(r.summary)),
    TROCAR_SUMMARY_KEY("effect_calls", "", "How often the code of each effect was entered.", effect_calls(r.statistics.effects)),
    TROCAR_SUMMARY_KEY("exact_contacts_total", "", "Contacts that continuous tests found, over all steps.", r.statistics.exact_contacts),
    TROCAR_SUMMARY_KEY("pressing_contacts_total", "", "Places where instruments pressed on walls, over all steps.", r.statistics.pressing_contacts),
    TROCAR_SUMMARY_KEY("overruns", "", "Steps that missed the budget.", r.summary.overruns),
    TROCAR_SUMMARY_KEY("realtime_overruns", "", "Whole steps that took longer than they simulate.", r.summary.realtime_overruns),
    TROCAR_SUMMARY_KEY("held_back_steps", "", "Steps whose motion was scaled to the safe fraction.", r.statistics.scaled_step_count),
    TROCAR_SUMMARY_KEY("within_distance_steps", "", "Steps in which skin and wall stayed nearer than the exact distance, proven not to touch.",
                       r.statistics.within_distance),
    TROCAR_SUMMARY_KEY("smallest_safe_fraction", "[-]", "Smallest share of a step's motion that was taken.", r.statistics.smallest_safe_fraction),
    TROCAR_SUMMARY_KEY("exact_abandoned_steps", "", "Steps whose exact stage the budget ended.", r.statistics.exact_abandoned),
    TROCAR_SUMMARY_KEY("unproven_steps", "", "Steps in which nothing proved an instrument free of its wall.", r.statistics.unproven_steps),
    TROCAR_SUMMARY_KEY("deepest_touch_m", "m", "Largest penetration depth between solid bodies.", r.statistics.deepest_touch_m),
    TROCAR_SUMMARY_KEY("passed_places_total", "", "Vertices beyond the middle of a solid body, over all steps.", r.statistics.passed_places),
    TROCAR_SUMMARY_KEY("softened_total", "", "Always 0.", r.statistics.softened),
    TROCAR_SUMMARY_KEY("raised_steps", "", "Steps in which a body took more sub-steps than `time.substeps` asks for, since stability does.", r.statistics.raised_steps),
    TROCAR_SUMMARY_KEY("explicit_bodies_total", "", "Implicit steps of bodies that did not converge; explicit sub-steps took their place.",
                       r.statistics.explicit_bodies),
    TROCAR_SUMMARY_KEY("contact_unconverged_total", "", "Solves of solid contact that ended at their bound.", r.statistics.unconverged_solves),
    TROCAR_SUMMARY_KEY("unproven_solids_total", "", "Pairs of solids that may have passed one another unseen, over all steps.",
                       r.statistics.unproven_solids),
    TROCAR_SUMMARY_KEY("left_pairs_total", "", "Pairs of solids that the budget left to their spheres, over all steps.", r.statistics.left_pairs),
    TROCAR_SUMMARY_KEY("below_floor_steps", "", "Steps that missed the budget although all that may be left out was left out.",
                       r.statistics.floor_steps),
    TROCAR_SUMMARY_KEY("floor_ms", "ms", "What the budget's scope takes of a step under a budget of nothing.",
                       where(r.summary.floor_ms >= 0.0, r.summary.floor_ms)),
    TROCAR_SUMMARY_KEY("carried_instrument_steps", "", "Steps in which the budget left an instrument at its predicted position, bounded by planes that are up to two steps old.",
                       of_instruments(r, r.statistics.carried_steps)),
    TROCAR_SUMMARY_KEY("steps_with_open_pairs", "", "Steps whose traversal the budget ended.", r.statistics.open_steps),
    TROCAR_SUMMARY_KEY("coarsest_level", "", "Coarsest level at which one of them ended.", r.statistics.coarsest_level),
    TROCAR_SUMMARY_KEY("corrections", "", "Repeated solves of instruments, over all steps.", r.statistics.corrections),
    TROCAR_SUMMARY_KEY("exact_insisted_steps", "", "Steps whose exact stage did not fit and ran all the same.", r.statistics.exact_forced),
    TROCAR_SUMMARY_KEY("dropped_steps", "", "Steps that left an effect out.", r.statistics.dropped_steps),
    TROCAR_SUMMARY_KEY("hand_limited_steps", "", "Steps whose drive command was cut to the drive's limit.", r.statistics.drive_limited_steps),
    TROCAR_SUMMARY_KEY("hand_stop_steps", "", "Steps in which a drive was stopped at the wall.", r.statistics.drive_stop_steps),
    TROCAR_SUMMARY_KEY("clamped_force_steps", "", "Always 0.", r.statistics.clamped_steps),
    TROCAR_SUMMARY_KEY("charged_ms", "ms", "Wall time that counted against the budget: `p50`, `p95`, `p99`, `max`.", percentiles(r.summary.charged_ms)),
    TROCAR_SUMMARY_KEY("work_units", "", "Units of work, over all steps.", r.statistics.work_units),
    TROCAR_SUMMARY_KEY("finite", "", "false: a state left its bounds and the run was stopped.", r.summary.finite),
    TROCAR_SUMMARY_KEY("failure", "", "Then the body, element and number; else empty.", r.summary.failure),
    TROCAR_SUMMARY_KEY("failed_step", "", "The step that failed; only then.", where(r.failed_step > 0, r.failed_step)),
    TROCAR_SUMMARY_KEY("last_good_state", "", "Folder of the state before it; only then.", where(!r.last_good_state.empty(), r.last_good_state)),
    TROCAR_SUMMARY_KEY("interrupted", "", "true: ended by a request, before its last step.", r.interrupted),
    TROCAR_SUMMARY_KEY("missing_outputs", "", "A sentence for each output that could not be written.", r.summary.missing_outputs),
    TROCAR_SUMMARY_KEY("resumed_from_step", "", "Of a resumed run: steps that were done before.", where(r.resumed_step > 0, r.resumed_step)),
    TROCAR_SUMMARY_KEY("checkpoint_step", "", "Step of the newest checkpoint, where there is one.", where(r.checkpoint_step > 0, r.checkpoint_step)),
    // instruments
    TROCAR_SUMMARY_KEY("tip_m", "m", "Last place of the first instrument's tip: x, y, z.",
                       of_instruments(r, (Json{r.statistics.tip.x(), r.statistics.tip.y(), r.statistics.tip.z()}))),
    TROCAR_SUMMARY_KEY("insertion_m", "m", "Last insertion of the first instrument.", of_instruments(r, r.statistics.insertion_m)),
    TROCAR_SUMMARY_KEY("rotation_rad", "rad", "Last rotation of its handle.", of_instruments(r, r.statistics.rotation_rad)),
    TROCAR_SUMMARY_KEY("largest_contact_force_n", "N", "Largest normal force on a wall.", of_instruments(r, r.statistics.largest_force_n)),
    TROCAR_SUMMARY_KEY("largest_handle_force_n", "N", "Largest force of the drive along the port's axis.",
                       of_instruments(r, r.statistics.largest_handle_n)),
    TROCAR_SUMMARY_KEY("largest_handle_torque_nm", "N m", "Largest torque of the drive.", of_instruments(r, r.statistics.largest_torque_nm)),
    TROCAR_SUMMARY_KEY("largest_rod_imbalance_n", "N", "Largest sum of all forces on an instrument; 0 is a perfect balance.",
                       of_instruments(r, r.statistics.largest_imbalance_n)),
    TROCAR_SUMMARY_KEY("largest_exchange_gap_n", "N", "Largest difference between what instruments push their walls with at a step's end and what the tissue felt of it then.",
                       of_instruments(r, r.statistics.largest_exchange_gap_n)),
    TROCAR_SUMMARY_KEY("rod_slowed_steps", "", "Steps in which an instrument was slowed.", of_instruments(r, r.statistics.slowed_steps)),
    TROCAR_SUMMARY_KEY("largest_rod_stretch", "[-]", "Largest share by which a segment of an instrument was longer or shorter than at rest.", of_instruments(r, r.statistics.largest_stretch)),
    TROCAR_SUMMARY_KEY("rod_stretched_steps", "", "Steps in which that was more than a tenth.", of_instruments(r, r.statistics.stretched_steps)),
    TROCAR_SUMMARY_KEY("self_contacts_total", "", "Places where instruments pressed on themselves, over all steps; with the effect alone.",
                       of_self_contact(r, r.statistics.self_contacts)),
    TROCAR_SUMMARY_KEY("self_held_steps", "", "Steps that took only a part of an instrument's motion, to keep it from passing through itself.",
                       of_self_contact(r, r.statistics.self_held_steps)),
    TROCAR_SUMMARY_KEY("largest_self_force_n", "N", "Largest sum of normal forces of instruments on themselves.",
                       of_self_contact(r, r.statistics.largest_self_n)),
    TROCAR_SUMMARY_KEY("instrument_contacts_total", "", "Places where instruments pressed on one another, over all steps; with the effect instrument_contact, or where one has play in a bore.",
                       of_instrument_contact(r, r.statistics.instrument_contacts)),
    TROCAR_SUMMARY_KEY("instrument_held_steps", "", "Steps that took only a part of the motion of instruments, to keep them from passing through one another.",
                       of_instrument_contact(r, r.statistics.instrument_held_steps)),
    TROCAR_SUMMARY_KEY("largest_instrument_force_n", "N", "Largest sum of normal forces between instruments.",
                       of_instrument_contact(r, r.statistics.largest_instrument_n)),
    TROCAR_SUMMARY_KEY("largest_bore_excess_m", "m", "Farthest that an instrument with play was beyond the bore that it runs in; where one has play.",
                       any_has_play(r) ? Json(r.statistics.largest_bore_excess_m) : left_out()),
    TROCAR_SUMMARY_KEY("rod_unsettled_total", "", "Stages of instruments whose contact forces had not settled.",
                       of_instruments(r, r.statistics.unsettled_rods)),
    TROCAR_SUMMARY_KEY("packing_density", "[-]", "Share of the scene's ball that instruments fill, where it names one.",
                       r.statistics.packing_density >= 0.0 ? of_instruments(r, r.statistics.packing_density) : left_out()),
    TROCAR_SUMMARY_KEY("target_distance_m", "m", "From the tip to the followed target: `last`, `min`.",
                       r.statistics.target_distance_m >= 0.0 ? of_instruments(r, target_distance(r.statistics)) : left_out()),
    // how it was made
    TROCAR_SUMMARY_KEY("step_s", "s", "What one step simulates.", r.scene.time.step),
    TROCAR_SUMMARY_KEY("observe_s", "s", "Wall time of pictures and records.", r.observe_s),
    TROCAR_SUMMARY_KEY("prepare_s", "s", "Wall time of the preparation.", r.prepared.seconds),
    TROCAR_SUMMARY_KEY("bodies", "", "A list, below.", bodies(r.prepared)),
    TROCAR_SUMMARY_KEY("instruments", "", "A list, below.", instruments(r.prepared.model)),
    TROCAR_SUMMARY_KEY("pictures", "", "File names.", r.pictures),
    TROCAR_SUMMARY_KEY("views", "", "X-ray views with `name`, `projection` (3 x 4 matrix), `moves`, `pixels`, `bits`, `frames`, `last` (docs/fluoroscopy.md).",
                       r.xrays != nullptr ? r.xrays->views() : left_out()),
    TROCAR_SUMMARY_KEY("fluoroscopy", "", "`energy_kev`, `bodies` with their attenuation, `iodine_kg` (docs/fluoroscopy.md).",
                       r.xrays != nullptr ? r.xrays->facts() : left_out()),
    TROCAR_SUMMARY_KEY("notices", "", "Sentences that the run printed.", r.notices),
    TROCAR_SUMMARY_KEY("version", "", "Of the program.", build_facts().version),
    TROCAR_SUMMARY_KEY("commit", "", "Of the sources that it was built from; `unknown` where it was built outside of a checkout.", build_facts().commit),
    TROCAR_SUMMARY_KEY("model_hash", "", "Hash of the prepared scene, hexadecimal: another scene, mesh or preparation has another.",
                       fmt::format("{:016x}", hash_model(r.prepared.model))),
    TROCAR_SUMMARY_KEY("machine", "", "`processor`, `cores`, `memory_gib`, `system`, `compiler`, `opengl`.",
                       (Json{{"processor", r.machine.processor},
                             {"cores", r.machine.cores},
                             {"memory_gib", r.machine.memory_gib},
                             {"system", r.machine.system},
                             {"compiler", r.machine.compiler},
                             {"opengl", r.gl}})),
    TROCAR_SUMMARY_KEY("command", "", "What repeats the run.", repeat_command(r.scene, r.resumed_step + r.summary.steps)),
};
#undef TROCAR_SUMMARY_KEY
#undef TROCAR_INSTRUMENT_KEY
#undef TROCAR_BODY_KEY
#undef TROCAR_KEY

} // namespace

void make_run_summary(RunRecord& record, double simulated_s, double wall_s, std::uint64_t state_hash) {
    RunStatistics& t = record.statistics;
    RunSummary& s = record.summary;
    s.steps = t.steps;
    s.simulated_s = simulated_s;
    s.wall_s = wall_s;
    s.realtime_factor = wall_s > 0.0 ? simulated_s / wall_s : 0.0;
    s.step_ms = find_percentiles(t.total_ms);
    s.collision_ms = find_percentiles(t.collision_ms);
    s.charged_ms = find_percentiles(t.charged_ms);
    for (std::size_t i = 0; i < kStageCount; ++i) record.stage_p50[i] = find_percentiles(t.stage_ms[i]).p50;
    s.overruns = t.overruns;
    s.realtime_overruns = t.count_slower_than_real_time(record.scene.time.step);
    const auto kept = [&](std::uint64_t over) {
        return t.steps > 0 ? static_cast<double>(t.steps - over) / static_cast<double>(t.steps) : 1.0;
    };
    s.budget_kept = kept(t.overruns);
    s.realtime_kept = kept(s.realtime_overruns);
    s.worst_overrun_ms = t.worst_overrun_ms;
    s.lumen_exits = t.lumen_exits;
    s.unresolved = t.unresolved;
    s.assumed = t.assumed;
    s.contacts = t.contacts;
    s.exact_steps = t.exact_steps;
    s.scaled_steps = t.scaled_step_count;
    s.unproven_steps = t.unproven_steps;
    s.passed_places = t.passed_places;
    s.floor_steps = t.floor_steps;
    s.unproven_solids = t.unproven_solids;
    s.target_distance_m = t.target_distance_m;
    s.state_hash = fmt::format("{:016x}", state_hash);
}

std::string summary_text(const RunRecord& record) {
    // names of files may hold any bytes; JSON is UTF-8
    return write_keys<RunRecord>(kSummaryKeys, record).dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::vector<OutputTable> summary_tables() {
    return {{"summary.json", "The run in numbers. Keys that say so are there only where they mean something.", keys_of<RunRecord>(kSummaryKeys)},
            {"summary.json: bodies", "One object for each body.", keys_of<BodyItem>(kBodyKeys)},
            {"summary.json: instruments", "One object for each instrument.", keys_of<InstrumentItem>(kInstrumentKeys)}};
}

} // namespace trocar::engine
