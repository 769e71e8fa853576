// Blood flows along the vessels that instruments move in, and drags them along.
#include "engine/effects/describe.hpp"
#include "engine/effects/registry.hpp"
#include "engine/prepare/scripted_motion.hpp"
#include "engine/prepare/vessel_flow.hpp"
#include "engine/state/flow_points.hpp"
#include "engine/state/state.hpp"
#include "fem/rod/rod.hpp"
#include "fem/rod/rod_flow.hpp"

#include <fmt/format.h>

#include <cmath>

namespace trocar::engine::effects {

namespace {

/// How far along the centreline the next node's place is looked for: segments of the rod, and metres beyond.
constexpr double kWindowSegments = 2.0, kWindow = 3e-3;

/// The rod's nodes one after another: each is looked for near the one before, so that it is never in a branch beside its own.
class FlowWalk {
public:
    FlowWalk(const BloodFlow& flow, std::span<const Vec3> points, Index start, double window) noexcept
        : flow_(flow), points_(points), at_(start), window_(window) {}

    /// Moves on to the point in whose cross-section p lies deepest.
    void move_to(const Vec3& p) noexcept {
        p_ = p;
        best_ = at_;
        share_ = share_at(at_);
        double length = 0.0;
        search_downstream(at_, 0.0, kNoIndex);
        for (Index i = at_; flow_.parents[i] != kNoIndex && length < window_; i = flow_.parents[i]) {
            const Index parent = flow_.parents[i];
            length += distance(parent, i);
            look_at(parent);
            search_downstream(parent, length, i);
        }
        at_ = best_;
    }

    /// m/s, of the blood at p where it moves with its mean speed.
    [[nodiscard]] Vec3 velocity() const noexcept {
        const double profile = 2.0 * std::max(0.0, 1.0 - share_); // Poiseuille
        const auto after = flow_.children_of(at_);
        const Vec3& from = points_[flow_.parents[at_] != kNoIndex ? flow_.parents[at_] : at_];
        const Vec3 way = points_[after.size() == 1 ? after.front() : at_] - from;
        const double length = std::sqrt(way.squaredNorm());
        return length > 0.0 ? Vec3(profile * flow_.speeds[at_] / length * way) : Vec3(Vec3::Zero());
    }
    [[nodiscard]] double radius() const noexcept { return flow_.radii[at_]; }

private:
    [[nodiscard]] double distance(Index a, Index b) const noexcept { return std::sqrt((points_[a] - points_[b]).squaredNorm()); }

    /// [-] square of the distance from the middle over that of the wall.
    [[nodiscard]] double share_at(Index i) const noexcept {
        return (points_[i] - p_).squaredNorm() / (flow_.radii[i] * flow_.radii[i] + 1e-12);
    }
    void look_at(Index i) noexcept {
        const double share = share_at(i);
        if (share < share_ || (share == share_ && i < best_)) {
            share_ = share;
            best_ = i;
        }
    }
    /// Everything within the window beyond `from`, which lies `length` from the start, but the branch that begins with `but`.
    void search_downstream(Index from, double length, Index but) noexcept {
        for (const Index child : flow_.children_of(from)) {
            if (child == but) continue;
            const double reached = length + distance(from, child);
            look_at(child);
            if (reached < window_) search_downstream(child, reached, kNoIndex);
        }
    }

    const BloodFlow& flow_;
    std::span<const Vec3> points_;
    Index at_, best_ = 0;
    double window_, share_ = 0.0;
    Vec3 p_ = Vec3::Zero();
};

/// The profile of Poiseuille around the centreline where the vessels stand now, seen from where the rod stands at the start of the step.
/// Nodes before the port feel nothing.
/// cost      O(node_count), some tens of centreline points a node
void find_flow(const EffectStep& step, std::size_t index, State& state, RodLoads& acting) {
    if (!step.live.blood_drag || !step.model.bodies[step.model.instruments[index].lumen].blood) return; // none around solids
    step.counts.note(blood_drag);
    const Blood& blood = *step.live.blood_drag;
    double rate = 1.0;
    if (blood.pulsatility > 0.0) rate += blood.pulsatility * (2.0 * wave_at(blood.period, step.time_t1) - 1.0);
    const InstrumentModel& instrument = step.model.instruments[index];
    const fem::RodModel& rod = instrument.rod;
    const fem::RodState& rod_t0 = state.instruments[index].rod;
    const std::span<const Vec3> points = find_flow_points(step.model, instrument.lumen, step.time_t1, state, acting.scratch);
    acting.flow.assign(rod.node_count(), {});
    const double form = fem::form_resistance(blood.density, rod.design.radius);
    FlowWalk walk(*step.model.bodies[instrument.lumen].blood, points, instrument.flow_entry, kWindowSegments * rod.segment + kWindow);
    for (Index i = fem::first_inserted_node(rod, rod_t0.insertion); i < rod.node_count(); ++i) {
        walk.move_to(rod_t0.position[i]);
        acting.flow[i] = {rate * walk.velocity(), fem::viscous_resistance(blood.viscosity, rod.design.radius, walk.radius()), form};
    }
}

Result<void> prepare_flow(const EffectPreparation& preparation) {
    const auto& spec = preparation.scene.effects.blood_drag;
    return spec ? prepare_vessel_flow(preparation, "effects.blood_drag", spec->speed, spec->inlet ? &*spec->inlet : nullptr) : Result<void>();
}

EffectLine explain_flow(const Scene& scene, const SceneModel&) {
    if (scene.instruments.empty()) return {false, kNoInstrument};
    if (!scene.effects.blood_drag) return {false, listed(false, {})};
    const Blood& blood = scene.effects.blood_drag->blood;
    return {true, fmt::format("{:g} m/s at the inlet, {:g} kg/m^3, {:g} mPa s{}", scene.effects.blood_drag->speed, blood.density, 1e3 * blood.viscosity,
                              blood.pulsatility > 0.0
                                  ? fmt::format(", {:g} % faster and slower with the pulse", 100.0 * blood.pulsatility)
                                  : "")};
}

} // namespace

const EffectDescriptor blood_drag{
    .name = "blood_drag",
    .label = "blood",
    .doc = "Drag of the blood on instruments: true for the defaults.",
    .acts_on = [](const SceneModel& model) { return model.effects.blood_drag && !model.instruments.empty(); },
    .remove =
        [](SceneModel& model) {
            model.effects.blood_drag.reset();
            std::erase_if(model.effects.added, [](const AddedEffect& added) { return added.effect == &contrast; }); // it goes with the flow
            for (BodyModel& body : model.bodies) body.blood.reset();
            for (InstrumentModel& instrument : model.instruments) instrument.flow_entry = 0;
        },
    .explain = explain_flow,
    .prepare = prepare_flow,
    .load_rod = find_flow,
};

} // namespace trocar::engine::effects
