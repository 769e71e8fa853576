// Weight of tissue and instruments.
#include "engine/effects/describe.hpp"
#include "engine/effects/registry.hpp"

#include <fmt/format.h>

namespace trocar::engine::effects {

const EffectDescriptor gravity{
    .name = "gravity",
    .label = "gravity",
    .doc = "Weight, as the key gravity says.",
    .acts_on =
        [](const SceneModel& model) {
            return model.effects.gravity && (!model.instruments.empty() || (model.effects.elasticity && any_body(model, deforms)));
        },
    .remove = [](SceneModel& model) { model.effects.gravity.reset(); },
    .explain = [](const Scene& scene, const SceneModel&) -> EffectLine {
        const Vec3& g = scene.gravity;
        const bool on = scene.effects.gravity;
        return {on, listed(on, fmt::format("({:g}, {:g}, {:g}) m/s^2", g.x(), g.y(), g.z()))};
    },
    .scale =
        [](EffectSet& live, double share) {
            if (!(share > 0.0)) live.gravity.reset();
        },
    .load_tissue =
        [](const EffectStep& step, std::size_t, const State&, TissueLoads& acting) {
            if (!step.live.gravity) return;
            acting.acceleration += *step.live.gravity;
            step.counts.note(gravity);
        },
    .load_rod =
        [](const EffectStep& step, std::size_t, State&, RodLoads& acting) {
            if (!step.live.gravity) return;
            acting.acceleration += *step.live.gravity;
            step.counts.note(gravity);
        },
};

} // namespace trocar::engine::effects
