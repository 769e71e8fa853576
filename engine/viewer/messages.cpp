#include "engine/viewer/messages.hpp"

#include "engine/render/camera.hpp"
#include "engine/report/places.hpp"
#include "engine/step/tissue/pull_stage.hpp"
#include "engine/prepare/body_pairs.hpp"
#include "engine/viewer/place_messages.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>

namespace trocar::engine::viewer {

namespace {

using Json = nlohmann::ordered_json;

/// Scene texts may hold anything; the page gets valid UTF-8.
std::string dump(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

Json point(const Vec3& v) { return {v.x(), v.y(), v.z()}; }

const char* kind_of(const BodyModel& body) noexcept {
    if (body.is_free_space) return "space";
    if (body.hollow) return "vessel";
    return body.motion == Motion::Deformable ? "organ" : "rigid";
}

Json describe_parts(const SceneModel& model) {
    Json parts = Json::array();
    for (std::size_t i = 0; i < model.bodies.size(); ++i) {
        const BodyModel& body = model.bodies[i];
        parts.push_back({{"name", body.name},
                         {"kind", kind_of(body)},
                         {"moves", body.moves()},
                         {"pullable", can_be_pulled(model, i)},
                         {"vertices", body.surface.vertices.size()},
                         {"triangles", body.is_free_space ? 0 : body.surface.triangles.size()}});
    }
    for (const InstrumentModel& instrument : model.instruments)
        parts.push_back({{"name", instrument.name},
                         {"kind", "instrument"},
                         {"moves", true},
                         {"pullable", false},
                         {"vertices", instrument.skin.vertex_count()},
                         {"triangles", instrument.skin.triangles.size()}});
    return parts;
}

/// What a descent reaches that leaves nothing open. Against a lumen only the instrument's own tree has levels.
int leaf_level(const SceneModel& model) {
    int level = 0;
    for (std::size_t i = 0; i < model.bodies.size(); ++i)
        for (std::size_t j = i + 1; j < model.bodies.size(); ++j)
            if (are_solid_pair(model, i, j))
                level = std::max({level, model.bodies[i].covering.tree.leaf_depth(), model.bodies[j].covering.tree.leaf_depth()});
    for (const InstrumentModel& instrument : model.instruments) level = std::max(level, instrument.chain.tree.leaf_depth());
    return level;
}

Json describe_budget(const BudgetLimits& limits) {
    Json budget{{"mode", mode_name(limits.mode)}};
    if (limits.mode == BudgetMode::Wall) budget["ms"] = 1e3 * limits.wall_s;
    if (limits.mode == BudgetMode::Work) budget["units"] = limits.work_units;
    return budget;
}

/// s and mg; null where the scene has no contrast.
Json describe_injection(const Snapshot& snapshot) {
    const auto& injection = snapshot.status.injection;
    if (!injection) return nullptr;
    const auto& [injected, in_vessels, washed_out] = snapshot.contrast;
    return {{"start_s", injection->start}, {"duration_s", injection->duration}, {"injected_mg", 1e6 * injected},
            {"in_vessels_mg", 1e6 * in_vessels}, {"washed_out_mg", 1e6 * washed_out}};
}

Json describe_saved(const SavedMarks& saved) {
    Json list = Json::array();
    for (const SavedMark& mark : saved.all())
        list.push_back({{"id", mark.id}, {"name", std::string(mark.name.data())}, {"step", mark.step}, {"time_s", mark.time_s}});
    return list;
}

Json describe_steps(const PlotHistory& plot, std::uint64_t& cursor) {
    Json steps = Json::array();
    std::uint64_t begin = std::max(cursor, plot.first());
    if (plot.end() - begin > PlotHistory::kInOneMessage) begin = plot.end() - PlotHistory::kInOneMessage;
    const auto short_number = [](double number) { return std::round(1e3 * number) / 1e3; };
    for (std::uint64_t k = begin; k < plot.end(); ++k) {
        const PlotPoint& p = plot.at(k);
        steps.push_back({p.step, short_number(p.total_ms), short_number(p.charged_ms), short_number(p.limit_ms), p.level, p.kept ? 1 : 0, short_number(p.force_n), short_number(1e3 * static_cast<double>(p.insertion_m))});
    }
    cursor = plot.end();
    return steps;
}

} // namespace

void PlotHistory::take(Exchange& exchange) {
    for (PlotPoint point; exchange.steps.pop(point);) {
        points_.push_back(point);
        if (points_.size() <= kKept) continue;
        points_.pop_front();
        ++first_;
    }
}

std::string scene_message(const Scene& scene, const PreparedScene& prepared, const Session& session, const LumenPlaces* places) {
    const SceneModel& model = prepared.model;
    Json message{{"type", "scene"}, {"name", scene.name}, {"file", project_path(scene.file)}, {"step_s", model.step_s}};
    message["parts"] = describe_parts(model);
    message["targets"] = Json::array();
    for (std::size_t k = 0; k < prepared.targets.size(); ++k)
        message["targets"].push_back(describe_mark(prepared.targets[k].position, scene.targets[k].name, model));
    message["vessel"] = describe_vessel(places, model);
    message["effects"] = Json::array();
    for (const EffectDescriptor* effect : registered_effects())
        if (session.permits(*effect)) message["effects"].push_back({{"name", effect->name}, {"label", effect->label}});
    message["scope"] = model.budget_covers_step ? "step" : "collision";
    message["budget"] = describe_budget(model.budget);
    message["budget_ms"] = {1e3 * kLeastBudget, 1e3 * kMostBudget};
    message["budget_work"] = {kLeastWork, kMostWork};
    message["most_saved"] = kMostSaved;
    message["leaf_level"] = leaf_level(model);
    message["view"] = {{"front", point(kFrontView)}, {"antero_posterior", point(kAnteroPosteriorView)}, {"up", point(Camera().up)}};
    message["has_instrument"] = session.has_instrument();
    message["has_script"] = session.has_script();
    if (session.has_instrument()) {
        const InstrumentModel& instrument = model.instruments[kLeadInstrument];
        message["limits"] = {{"speed", instrument.limits.speed}, {"rotation", instrument.limits.rotation}};
        message["radius"] = instrument.rod.design.radius;
    }
    return dump(message);
}

std::string status_message(const Snapshot& snapshot, std::uint32_t frame, const SeatView& seats, const PlotHistory& plot,
                           std::uint64_t not_shown, std::uint64_t& cursor) {
    const StepReport& report = snapshot.report;
    const SessionStatus& status = snapshot.status;
    Json message{{"type", "status"},
                 {"frame", frame},
                 {"you", seats.you},
                 {"driver", seats.driver},
                 {"viewers", seats.viewers},
                 {"run", snapshot.run},
                 {"step", report.step},
                 {"time_s", report.time_s},
                 {"paused", status.paused},
                 {"script", status.script},
                 {"grabbed", status.grabbed},
                 {"stepped", status.stepped},
                 {"pace", snapshot.pace},
                 {"pace_wanted", status.pace},
                 {"drive", {status.drive.insertion, status.drive.rotation}},
                 {"budget", describe_budget(status.budget)}};
    Json& effects = message["effects"] = Json::object();
    for (const EffectDescriptor* effect : registered_effects())
        if (effect->scale != nullptr) effects[std::string(effect->name)] = status.effects[index_of(*effect)];
    message.update({{"total_ms", report.ms.total},
                    {"charged_ms", report.ms.budget},
                    {"kept", report.budget_kept},
                    {"stages_ms", {report.ms.fem, report.ms.steer, report.ms.descend, report.ms.exact, report.ms.respond}},
                    {"level", report.level_reached},
                    {"pairs_tested", report.pairs_tested},
                    {"pairs_open", report.pairs_open},
                    {"assumed", report.assumed},
                    {"error_m", snapshot.assumed_error_m},
                    {"exact_ran", report.exact_ran},
                    {"exact_insisted", report.exact_forced},
                    {"exact_contacts", report.exact_contacts},
                    {"pressing_contacts", report.pressing_contacts},
                    {"unproven", report.unproven_links},
                    {"dropped", report.dropped}});
    message.update({{"force_n", report.contact_force_n},
                    {"max_force_n", report.max_contact_force_n},
                    {"pull_n", report.pull_force_n},
                    {"safe_fraction", report.safe_fraction},
                    {"hand_stops", report.drive_stops},
                    {"lumen_exits", report.lumen_exits},
                    {"insertion_m", report.insertion_m},
                    {"rotation_rad", report.rotation_rad},
                    {"tip", point(report.tip)},
                    {"target_m", report.target_distance_m},
                    {"substeps", report.substeps},
                    {"failure", report.failure},
                    {"dots_left_out", snapshot.contacts_left_out},
                    {"spheres_left_out", snapshot.spheres_left_out},
                    {"recorded", snapshot.recorded_steps},
                    {"repeatable", snapshot.repeatable},
                    {"injection", describe_injection(snapshot)},
                    {"work_enough", snapshot.work_enough},
                    {"not_shown", not_shown}});
    message["saved"] = describe_saved(status.saved);
    message["steps"] = describe_steps(plot, cursor);
    return dump(message);
}

std::string error_message(std::string_view text) { return dump({{"type", "error"}, {"text", std::string(text)}}); }
std::string notice_message(std::string_view text) { return dump({{"type", "notice"}, {"text", std::string(text)}}); }
std::string pong_message(double number) { return dump({{"type", "pong"}, {"number", number}}); }

CommandRange range_of(const SceneModel& model) {
    CommandRange range;
    range.contrast = effects::find_injection(model).has_value();
    for (std::size_t i = 0; i < model.bodies.size(); ++i) {
        range.vertices.push_back(model.bodies[i].surface.vertices.size());
        range.pullable.push_back(can_be_pulled(model, i));
        range.triangles.push_back(model.bodies[i].surface.triangles.size());
    }
    return range;
}

} // namespace trocar::engine::viewer
