// Respiration moves the held nodes of every deformable body together, there and back once a period.
#include "engine/effects/describe.hpp"
#include "engine/effects/registry.hpp"
#include "engine/prepare/scripted_motion.hpp"
#include "engine/state/state.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

namespace trocar::engine::effects {

/// [-] of the fastest moment of a breath. Steps that were scaled to their safe fraction leave the organ behind its breath; making up for
/// all of it in one step would throw the walls about, and be scaled again.
static constexpr double kCatchUp = 2.0;

/// Where the breath takes what is fixed, from where it is now.
static Vec3 breathe(const BreathingSpec& breath, const Vec3& now, double time, double dt) {
    const Vec3 wanted = breath.amplitude * wave_at(breath.period, time) * breath.direction;
    const double fastest = std::numbers::pi * breath.amplitude / breath.period;
    const Vec3 way = wanted - now;
    const double length = std::sqrt(way.squaredNorm());
    const double most = kCatchUp * fastest * dt;
    return length <= most ? wanted : Vec3(now + (most / length) * way);
}

static void move_held_nodes(const EffectStep& step, std::size_t body, const State& state, TissueLoads& acting) {
    const fem::TissueModel& tissue = *step.model.bodies[body].tissue;
    if (!step.live.breathing || tissue.pinned.empty()) return;
    step.counts.note(breathing);
    const Index any = tissue.pinned.front(); // they all move alike
    const Vec3 now = state.bodies[body].tissue.position[any] - tissue.rest_position[any];
    const Vec3 moved = breathe(*step.live.breathing, now, step.time_t1, step.model.step_s);
    for (const Index node : tissue.pinned) acting.pinned_target.push_back(tissue.rest_position[node] + moved);
}

const EffectDescriptor breathing{
    .name = "breathing",
    .label = "breathing",
    .doc = "Respiration: true for the defaults.",
    .acts_on =
        [](const SceneModel& model) {
            const auto is_held = [](const BodyModel& body) { return body.tissue && !body.tissue->pinned.empty(); };
            return model.effects.breathing && model.effects.elasticity && any_body(model, is_held);
        },
    .remove = [](SceneModel& model) { model.effects.breathing.reset(); },
    .explain = [](const Scene& scene, const SceneModel&) -> EffectLine {
        const auto& spec = scene.effects.breathing;
        if (!spec) return {false, listed(false, {})};
        return {true, fmt::format("{:g} mm every {:g} s, on the fixed nodes", 1e3 * spec->amplitude, spec->period)};
    },
    .scale =
        [](EffectSet& live, double share) {
            if (live.breathing) live.breathing->amplitude *= share;
        },
    .fades = true,
    .load_tissue = move_held_nodes,
};

} // namespace trocar::engine::effects
