#include "engine/report/summary.hpp"

#include "engine/report/xray_frames.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace trocar::engine {

namespace {

using Json = nlohmann::ordered_json;

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

Json bodies(const PreparedScene& prepared) {
    Json list = Json::array();
    for (std::size_t i = 0; i < prepared.bodies.size(); ++i) {
        const BodySummary& body = prepared.bodies[i];
        const BodyModel& model = prepared.model.bodies[i];
        Json json{{"name", body.name},
                  {"motion", motion_name(model)},
                  {"hollow", model.hollow},
                  {"vertices", body.vertices},
                  {"triangles", body.triangles},
                  {"coarse_nodes", body.coarse_nodes},
                  {"coarse_tets", body.coarse_tets},
                  {"pinned_nodes", body.pinned_nodes},
                  {"stable_step_s", body.stable_step_s},
                  {"links", body.links},
                  {"static_links", body.static_links},
                  {"degenerate_links", body.degenerate_links},
                  {"longest_link_m", body.longest_link_m},
                  {"tree_spheres", body.tree_spheres},
                  {"free_balls", body.inscribed_spheres},
                  {"notes", body.notes}};
        list.push_back(std::move(json));
    }
    return list;
}

Json instruments(const SceneModel& model) {
    Json list = Json::array();
    for (const InstrumentModel& instrument : model.instruments) {
        Json json{{"name", instrument.name},
                  {"rod_nodes", instrument.rod.node_count()},
                  {"length_m", instrument.rod.design.length},
                  {"radius_m", instrument.rod.design.radius},
                  {"skin_triangles", instrument.skin.triangles.size()},
                  {"lumen", model.bodies[instrument.lumen].name}};
        json["kind"] = instrument.mass_spring_substeps > 0 ? "mass_spring" : "rod";
        if (instrument.mass_spring_substeps > 0) json["substeps"] = instrument.mass_spring_substeps;
        if (instrument.inside) json["inside"] = model.instruments[*instrument.inside].name;
        if (instrument.route) json["route_m"] = instrument.route->length.back();
        list.push_back(std::move(json));
    }
    return list;
}

/// What the contract names, in its order.
Json contract_part(const RunRecord& record) {
    const RunSummary& s = record.summary;
    const RunStatistics& t = record.statistics;
    const BudgetSpec& budget = record.scene.budget;
    Json json;
    json["scene"] = project_path(record.scene.file);
    json["steps"] = s.steps;
    json["mode"] = mode_name(budget.limits.mode);
    json["budget"] = budget.to_string();
    json["budget_scope"] = budget.scope == BudgetScope::Step ? "step" : "collision";
    json["simulated_s"] = s.simulated_s;
    json["wall_s"] = s.wall_s;
    json["realtime_factor"] = s.realtime_factor;
    json["step_ms"] = percentiles(s.step_ms);
    json["collision_ms"] = percentiles(s.collision_ms);
    json["budget_kept"] = s.budget_kept;
    json["realtime_kept"] = s.realtime_kept;
    json["worst_overrun_ms"] = s.worst_overrun_ms;
    json["substeps"] = t.substeps;
    json["stable_step_s"] = t.stable_step_s;
    json["min_volume_ratio"] = t.min_volume_ratio;
    json["inverted_tets_max"] = t.inverted_tets;
    json["exact_steps"] = s.exact_steps;
    json["contacts_total"] = s.contacts;
    json["unresolved_total"] = s.unresolved;
    json["assumed_total"] = s.assumed;
    json["lumen_exits"] = s.lumen_exits;
    json["energy_j"] = {{"first", t.energy.first}, {"last", t.energy.last}, {"max", t.energy.max}};
    json["stages_ms"] = stages(record.stage_p50);
    json["effects"] = record.scene.effects.names();
    json["state_hash"] = s.state_hash;
    return json;
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

void add_losses(const RunRecord& record, Json& json) {
    const RunStatistics& t = record.statistics;
    json["pace"] = pace(record.summary);
    for (const EffectDescriptor* effect : registered_effects())
        if (effect->in_step) json["effect_calls"][std::string(effect->name)] = t.effects.of(*effect);
    json["exact_contacts_total"] = t.exact_contacts;       // found by continuous tests
    json["pressing_contacts_total"] = t.pressing_contacts; // places of instruments on their walls; contacts_total has those of solids too
    json["overruns"] = record.summary.overruns;
    json["realtime_overruns"] = record.summary.realtime_overruns;
    json["held_back_steps"] = t.scaled_step_count;
    json["within_distance_steps"] = t.within_distance;
    json["smallest_safe_fraction"] = t.smallest_safe_fraction;
    json["exact_abandoned_steps"] = t.exact_abandoned;
    json["unproven_steps"] = t.unproven_steps;
    json["deepest_touch_m"] = t.deepest_touch_m;
    json["passed_places_total"] = t.passed_places;
    json["softened_total"] = t.softened;
    json["contact_unconverged_total"] = t.unconverged_solves;
    json["unproven_solids_total"] = t.unproven_solids;
    json["left_pairs_total"] = t.left_pairs;
    json["below_floor_steps"] = t.floor_steps;
    if (record.summary.floor_ms >= 0.0) json["floor_ms"] = record.summary.floor_ms;
    json["steps_with_open_pairs"] = t.open_steps;
    json["coarsest_level"] = t.coarsest_level;
    json["corrections"] = t.corrections;
    json["exact_insisted_steps"] = t.exact_forced;
    json["dropped_steps"] = t.dropped_steps;
    json["hand_limited_steps"] = t.drive_limited_steps;
    json["hand_stop_steps"] = t.drive_stop_steps;
    json["clamped_force_steps"] = t.clamped_steps;
    json["work_units"] = t.work_units;
    json["finite"] = record.summary.finite;
    json["failure"] = record.summary.failure;
    if (record.failed_step > 0) json["failed_step"] = record.failed_step;
    if (!record.last_good_state.empty()) json["last_good_state"] = record.last_good_state;
    json["interrupted"] = record.interrupted;
    json["missing_outputs"] = record.summary.missing_outputs;
    if (record.resumed_step > 0) json["resumed_from_step"] = record.resumed_step;
    if (record.checkpoint_step > 0) json["checkpoint_step"] = record.checkpoint_step;
}

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
    const RunStatistics& t = record.statistics;
    Json json = contract_part(record);
    add_losses(record, json);
    if (!record.prepared.model.instruments.empty()) {
        json["tip_m"] = {t.tip.x(), t.tip.y(), t.tip.z()};
        json["insertion_m"] = t.insertion_m;
        json["rotation_rad"] = t.rotation_rad;
        json["largest_contact_force_n"] = t.largest_force_n;
        json["largest_handle_force_n"] = t.largest_handle_n;
        json["largest_handle_torque_nm"] = t.largest_torque_nm;
        json["largest_rod_imbalance_n"] = t.largest_imbalance_n;
        json["rod_slowed_steps"] = t.slowed_steps;
        if (record.prepared.model.effects.self_contact) {
            json["self_contacts_total"] = t.self_contacts;
            json["self_held_steps"] = t.self_held_steps;
            json["largest_self_force_n"] = t.largest_self_n;
        }
        if (record.prepared.model.effects.instrument_contact) {
            json["instrument_contacts_total"] = t.instrument_contacts;
            json["instrument_held_steps"] = t.instrument_held_steps;
            json["largest_instrument_force_n"] = t.largest_instrument_n;
        }
        json["rod_unsettled_total"] = t.unsettled_rods;
        if (t.packing_density >= 0.0) json["packing_density"] = t.packing_density;
        if (t.target_distance_m >= 0.0) json["target_distance_m"] = {{"last", t.target_distance_m}, {"min", t.closest_target_m}};
    }
    json["step_s"] = record.scene.time.step;
    json["observe_s"] = record.observe_s;
    json["prepare_s"] = record.prepared.seconds;
    json["bodies"] = bodies(record.prepared);
    json["instruments"] = instruments(record.prepared.model);
    json["pictures"] = record.pictures;
    if (record.xrays != nullptr) {
        json["views"] = record.xrays->views();
        json["fluoroscopy"] = record.xrays->facts();
    }
    json["notices"] = record.notices;
    json["machine"] = {{"processor", record.machine.processor},   {"cores", record.machine.cores},
                       {"memory_gib", record.machine.memory_gib}, {"system", record.machine.system},
                       {"compiler", record.machine.compiler},     {"opengl", record.gl}};
    json["command"] = repeat_command(record.scene, record.resumed_step + record.summary.steps);
    // names of files may hold any bytes; JSON is UTF-8
    return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

} // namespace trocar::engine
