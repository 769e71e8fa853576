// Viscosity and mass damping of the materials, without which tissue oscillates for ever.
#include "engine/effects/describe.hpp"
#include "engine/effects/registry.hpp"

namespace trocar::engine::effects {

static bool is_damped(const BodyModel& body) {
    return body.tissue && (body.tissue->material.viscosity > 0.0 || body.tissue->material.mass_damping > 0.0);
}

/// The same tissue of a material without viscosity and drag: nothing else of a model is made of them but what preconditions implicit steps, which may be another.
static void remove_damping(BodyModel& body) { body.tissue->material.viscosity = body.tissue->material.mass_damping = 0.0; }

const EffectDescriptor damping{
    .name = "damping",
    .label = "damping",
    .doc = "Viscosity and mass damping of the materials.",
    .acts_on = [](const SceneModel& model) { return model.effects.elasticity && any_body(model, is_damped); },
    .remove =
        [](SceneModel& model) {
            for (BodyModel& body : model.bodies)
                if (is_damped(body)) remove_damping(body);
        },
    .explain = [](const Scene& scene, const SceneModel& model) -> EffectLine {
        const bool on = scene.effects.damping;
        if (!any_body(model, deforms)) return {false, kNothingDeforms};
        return {on, listed(on, "viscosity and mass damping of the materials")};
    },
    .load_tissue =
        [](const EffectStep& step, std::size_t body, const State&, TissueLoads&) {
            if (is_damped(step.model.bodies[body])) step.counts.note(damping);
        },
};

} // namespace trocar::engine::effects
