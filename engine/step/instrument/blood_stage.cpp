#include "engine/step/instrument/blood_stage.hpp"

#include "engine/step/tissue/scripted_motion.hpp"


#include <cmath>

namespace trocar::engine {

namespace {

/// How far along the centreline the next node's place is looked for: segments of the rod, and metres beyond.
constexpr double kWindowSegments = 2.0, kWindow = 3e-3;

/// Where the vessel stands now.
std::span<const Vec3> flow_points_now(const SceneModel& model, std::size_t body, State& state, WallScratch& scratch) {
    const BodyModel& vessel = model.bodies[body];
    const BloodFlow& flow = *vessel.blood;
    if (flow.links) {
        scratch.flow_points.resize(flow.point_count());
        fem::update_embedded_surface(*flow.links, state.bodies[vessel.host_body].tissue.position, flow.points, state.bodies[body].flow_frames, scratch.flow_points);
        return scratch.flow_points;
    }
    if (vessel.path.empty()) return flow.points;
    const Vec3 moved = evaluate_motion(vessel.path, state.time + model.step_s);
    scratch.flow_points.resize(flow.point_count());
    for (std::size_t i = 0; i < flow.point_count(); ++i) scratch.flow_points[i] = flow.points[i] + moved;
    return scratch.flow_points;
}

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

void find_flow_of(const SceneModel& model, std::size_t index, double rate, std::span<const Vec3> points, RodsScratch& rods) {
    const InstrumentModel& instrument = model.instruments[index];
    const fem::RodModel& rod = instrument.rod;
    const Blood& blood = *model.effects.blood_drag;
    InstrumentScratch& scratch = rods.instruments[index];
    scratch.flow.assign(rod.node_count(), {});
    const double form = fem::form_resistance(blood.density, rod.design.radius);
    FlowWalk walk(*model.bodies[instrument.lumen].blood, points, instrument.flow_entry, kWindowSegments * rod.segment + kWindow);
    for (Index i = fem::first_inserted_node(rod, scratch.rod_t0.insertion); i < rod.node_count(); ++i) {
        walk.move_to(scratch.rod_t0.position[i]);
        scratch.flow[i] = {rate * walk.velocity(), fem::viscous_resistance(blood.viscosity, rod.design.radius, walk.radius()), form};
    }
}

} // namespace

void find_blood_flow(const SceneModel& model, State& state, RodsScratch& rods, StepReport& report) {
    if (!model.effects.blood_drag) return;
    const Blood& blood = *model.effects.blood_drag;
    double rate = 1.0;
    if (blood.pulsatility > 0.0) rate += blood.pulsatility * (2.0 * wave_at(blood.period, state.time + model.step_s) - 1.0);
    for (std::size_t i = 0; i < model.instruments.size(); ++i) {
        report.effects.note(Effect::BloodDrag);
        const std::size_t vessel = model.instruments[i].lumen;
        find_flow_of(model, i, rate, flow_points_now(model, vessel, state, rods.walls[vessel]), rods);
    }
}

} // namespace trocar::engine
