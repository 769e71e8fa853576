// The walls of hollow bodies widen and narrow with the heart.
#include "engine/effects/describe.hpp"
#include "engine/effects/registry.hpp"
#include "engine/prepare/scripted_motion.hpp"

#include <fmt/format.h>

namespace trocar::engine::effects {

static void widen(const EffectStep& step, std::size_t body, std::span<Vec3> surface) {
    const std::vector<Vec3>& reach = step.model.bodies[body].pulse_reach;
    if (reach.empty()) return;
    step.counts.note(pulse);
    const double share = wave_at(step.model.effects.pulse->period, step.time_t1);
    for (std::size_t v = 0; v < surface.size(); ++v) surface[v] += share * reach[v];
}

const EffectDescriptor pulse{
    .name = "pulse",
    .label = "pulse",
    .doc = "Arterial pulse: true for the defaults.",
    .acts_on = [](const SceneModel& model) { return any_body(model, [](const BodyModel& body) { return !body.pulse_reach.empty(); }); },
    .remove =
        [](SceneModel& model) {
            model.effects.pulse.reset();
            if (model.effects.blood_drag) model.effects.blood_drag->pulsatility = model.effects.blood_drag->period = 0.0;
            for (BodyModel& body : model.bodies) body.pulse_reach.clear();
        },
    .explain = [](const Scene& scene, const SceneModel&) -> EffectLine {
        const auto& spec = scene.effects.pulse;
        if (!spec) return {false, listed(false, {})};
        return {true, fmt::format("walls widen by {:g} % of their radius every {:g} s", 100.0 * spec->amplitude, spec->period)};
    },
    .move_surface = widen,
};

} // namespace trocar::engine::effects
