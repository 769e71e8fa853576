// A bolus of contrast agent, carried by the flow of the blood along the vessels' centreline, shared out at branches as the blood is, and
// washed out at their ends. Nothing of it acts on a body or an instrument.
#include "engine/effects/contrast/contrast.hpp"

#include "engine/effects/describe.hpp"
#include "engine/effects/registry.hpp"
#include "engine/prepare/scripted_motion.hpp"
#include "engine/prepare/vessel_flow.hpp"
#include "engine/state/flow_points.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace trocar::engine::effects {

namespace {

constexpr double kMillilitre = 1e-6; // m^3
constexpr unsigned kMostParts = 8;   // of a step, in which blood passes several pieces of vessel

/// In the order of the descriptor's keys.
enum Setting : std::size_t { kRate, kIodine, kStart, kDuration, kAt, kPlace, kSpeed = kPlace + 3 };

const BloodFlow* flow_of(const SceneModel& model) {
    if (model.instruments.empty()) return nullptr;
    const auto& blood = model.bodies[model.instruments.front().lumen].blood;
    return blood ? &*blood : nullptr;
}

/// What the State keeps: iodine and flow of each piece, then what has been injected and washed out.
std::size_t memory_of(const SceneModel& model) {
    const BloodFlow* flow = flow_of(model);
    return flow != nullptr ? 2 * flow->point_count() + 2 : 0;
}

const std::vector<double>* find_memory(const SceneModel& model, const State& state) {
    for (std::size_t i = 0; i < state.effects.size(); ++i)
        if (model.effects.added[i].effect == &contrast && flow_of(model) != nullptr && state.effects[i].size() == memory_of(model)) return &state.effects[i];
    return nullptr;
}

double pulse_at(const EffectStep& step) {
    const auto& blood = step.live.blood_drag;
    if (!blood || !(blood->pulsatility > 0.0)) return 1.0;
    return std::max(0.0, 1.0 + blood->pulsatility * (2.0 * wave_at(blood->period, step.time_t1) - 1.0));
}

/// The lead instrument's step carries all of it.
void carry(const EffectStep& step, std::size_t instrument, State& state, RodLoads& acting) {
    const BloodFlow* flow = flow_of(step.model);
    if (instrument != 0 || flow == nullptr) return;
    step.counts.note(contrast);
    std::vector<double>& memory = state.effects[step.added];
    const std::size_t count = flow->point_count();
    const std::span<double> iodine = std::span(memory).first(count), passing = std::span(memory).subspan(count, count);
    const double dt = step.model.step_s, from = step.settings[kStart], to = from + step.settings[kDuration];
    const double share = std::max(0.0, std::min(to, step.time_t1) - std::max(from, step.time_t1 - dt)) / dt;
    const double rate = std::min(share, 1.0) * step.settings[kRate] * kMillilitre, injected = step.settings[kIodine];
    std::size_t at = 0;
    if (rate > 0.0) {
        const bool is_place = step.settings[kAt] != 0.0;
        const Vec3 place(step.settings[kPlace], step.settings[kPlace + 1], step.settings[kPlace + 2]);
        if (is_place)
            at = find_flow_point(*flow, place);
        else
            at = find_flow_point(*flow, state.instruments[0].rod.position.back(),
                                 find_flow_points(step.model, step.model.instruments[0].lumen, step.time_t1, state, acting.scratch));
        if (at == 0) at = flow->children_of(0).front();
    } else if (std::all_of(iodine.begin(), iodine.end(), [](double c) { return c == 0.0; }))
        return;
    double turns = 0.0; // of a step, how many pieces the blood passes on average
    for (Index i = 1; i < count; ++i) {
        const double length = (flow->points[i] - flow->points[flow->parents[i]]).norm();
        if (length > 0.0) turns += flow->speeds[i] * dt / length;
    }
    const auto parts = static_cast<unsigned>(std::clamp(std::ceil(turns / static_cast<double>(count)), 1.0, static_cast<double>(kMostParts)));
    const double beat = pulse_at(step);
    for (unsigned k = 0; k < parts; ++k) memory[2 * count + 1] += advect(*flow, iodine, passing, beat, at, rate, injected, dt / parts);
    memory[2 * count] += rate * injected * dt;
}

Result<void> prepare_contrast(const EffectPreparation& preparation) {
    const auto& [scene, coarse, shelf, prepared] = preparation;
    const auto own = std::find_if(scene.effects.added.begin(), scene.effects.added.end(), [](const AddedEffect& added) { return added.effect == &contrast; });
    if (own == scene.effects.added.end()) return {};
    const std::string key = "effects.contrast";
    if (prepared.model.instruments.empty())
        return scene_error(scene, key, "the scene has no instrument, and contrast flows in the vessel that one moves in; expected an instrument");
    if (!scene.effects.blood_drag)
        if (Result<void> done = prepare_vessel_flow(preparation, key, own->settings[kSpeed], nullptr); !done) return done;
    const BloodFlow* flow = flow_of(prepared.model);
    const bool flows = flow != nullptr && flow->point_count() > 1 && flow->speeds[1] > 0.0 && !flow->children_of(0).empty();
    if (!flows)
        return scene_error(scene, key,
                           fmt::format("no blood flows through \"{}\": it has no outlet, or the blood's speed is 0; expected a vessel that blood "
                                       "comes in and goes out of",
                                       prepared.model.bodies[prepared.model.instruments.front().lumen].name));
    return {};
}

EffectLine explain_contrast(const Scene& scene, const SceneModel&) {
    const auto own = std::find_if(scene.effects.added.begin(), scene.effects.added.end(), [](const AddedEffect& added) { return added.effect == &contrast; });
    if (own == scene.effects.added.end()) return {false, listed(false, {})};
    const auto& s = own->settings;
    return {true, fmt::format("{:g} ml/s of {:g} mg iodine/ml from {:g} s for {:g} s at {}", s[kRate], s[kIodine], s[kStart], s[kDuration],
                              s[kAt] != 0.0 ? "a place" : "the tip")};
}

} // namespace

double piece_volume(const BloodFlow& vessels, Index point) noexcept {
    if (vessels.parents[point] == kNoIndex) return 0.0;
    return std::numbers::pi * vessels.radii[point] * vessels.radii[point] * (vessels.points[point] - vessels.points[vessels.parents[point]]).norm();
}

double advect(const BloodFlow& vessels, std::span<double> iodine, std::span<double> flow, double beat, std::size_t at, double rate, double injected,
              double step) {
    const auto count = static_cast<Index>(vessels.point_count());
    const auto own_flow = [&](Index i) { return std::numbers::pi * vessels.radii[i] * vessels.radii[i] * vessels.speeds[i] * beat; };
    const double into = rate > 0.0 ? own_flow(static_cast<Index>(at)) : 0.0;
    // what is injected flows on downstream beside the blood, shared as that is
    const double more = into > 0.0 ? rate / into : 0.0;
    for (Index i = 0; i < count; ++i) {
        const Index parent = vessels.parents[i];
        const bool is_downstream = parent != kNoIndex && more > 0.0 && (i == at || flow[parent] < 0.0);
        flow[i] = is_downstream ? -own_flow(i) * (1.0 + more) : own_flow(i); // negative: marks what lies downstream
    }
    for (Index i = 0; i < count; ++i) flow[i] = std::abs(flow[i]);
    // from upstream: at the place of injection the blood alone
    const auto comes_in = [&](Index i) { return i == at && more > 0.0 ? own_flow(i) : flow[i]; };
    double washed = 0.0;
    for (Index i = 1; i < count; ++i) {
        const auto children = vessels.children_of(i);
        double out = children.empty() ? flow[i] : 0.0;
        for (const Index child : children) out += comes_in(child);
        const Index parent = vessels.parents[i];
        const double volume = piece_volume(vessels, i);
        double mass = volume * iodine[i] + step * comes_in(i) * iodine[parent];
        if (i == at) mass += step * rate * injected;
        const double room = volume + step * out;
        iodine[i] = room > 0.0 ? mass / room : 0.0;
        if (children.empty()) washed += step * out * iodine[i];
    }
    return washed;
}

std::optional<Injection> find_injection(const SceneModel& model) {
    for (const AddedEffect& added : model.effects.added)
        if (const auto& s = added.settings; added.effect == &contrast) return Injection{s[kRate] * kMillilitre, s[kIodine], s[kStart], s[kDuration]};
    return std::nullopt;
}

void set_injection_start(SceneModel& model, double start) {
    for (AddedEffect& added : model.effects.added)
        if (added.effect == &contrast) added.settings[kStart] = start;
}

ContrastBalance measure_contrast(const SceneModel& model, const State& state) {
    const std::vector<double>* memory = find_memory(model, state);
    if (memory == nullptr) return {};
    const BloodFlow& flow = *flow_of(model);
    const std::size_t count = flow.point_count();
    ContrastBalance balance{(*memory)[2 * count], 0.0, (*memory)[2 * count + 1]};
    for (Index i = 1; i < count; ++i) balance.in_vessels += piece_volume(flow, i) * (*memory)[i];
    return balance;
}

void visit_contrast(const SceneModel& model, const State& state, std::vector<Vec3>& points,
                    const std::function<void(const Vec3& from, const Vec3& to, double radius, double iodine)>& visit) {
    const std::vector<double>* memory = find_memory(model, state);
    if (memory == nullptr) return;
    const BloodFlow& flow = *flow_of(model);
    fem::LinkFrames frames;
    const std::span<const Vec3> now = find_flow_points(model, model.instruments.front().lumen, state, frames, points);
    for (Index i = 1; i < flow.point_count(); ++i) visit(now[flow.parents[i]], now[i], flow.radii[i], (*memory)[i]);
}

double find_iodine(const SceneModel& model, const State& state, const Vec3& rest_place) {
    const std::vector<double>* memory = find_memory(model, state);
    return memory != nullptr ? (*memory)[find_flow_point(*flow_of(model), rest_place)] : 0.0;
}

const EffectDescriptor contrast{
    .name = "contrast",
    .label = "contrast",
    .doc = "Contrast agent, injected and carried by the blood; X-ray frames show it. true for the defaults.",
    .settings = {number_field("rate", Dimension::None, {0.001, 100.0, false, 0.1, 30.0, "injections are 0.5 to 20 ml/s"}, "Of the injection, ml/s.").by_default(3.0),
                 number_field("iodine", Dimension::None, {1.0, 1000.0, false, 100.0, 400.0, "agents have 240 to 370 mg iodine/ml"}, "Of the agent, mg/ml.").by_default(300.0),
                 number_field("start", Dimension::Time, between(0.0, 1e6), "Of the injection.").by_default(0.0),
                 number_field("duration", Dimension::Time, above(0.0, 1e4), "Of the injection.").by_default(2.0),
                 choice_field("at", {"tip", "place"}, "The first instrument's tip, or the place.").by_default(std::string_view("tip")),
                 vector_field("place", Dimension::Length, coordinate(), "Of the injection, where at says so.").by_default(Vec3(0, 0, 0)),
                 number_field("speed", Dimension::Speed, between(1e-4, 5.0), "Of the blood at the inlet, where the effect blood_drag does not say it.").by_default(0.2)},
    .explain = explain_contrast,
    .memory = memory_of,
    .prepare = prepare_contrast,
    .load_rod = carry,
};

} // namespace trocar::engine::effects
