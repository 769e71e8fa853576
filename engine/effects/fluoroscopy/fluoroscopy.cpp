// X-ray pictures beside the shaded ones. No step knows of it: engine/report takes them.
#include "engine/effects/describe.hpp"
#include "engine/effects/registry.hpp"

namespace trocar::engine::effects {

const EffectDescriptor fluoroscopy{
    .name = "fluoroscopy",
    .label = "X-ray",
    .doc = "X-ray pictures.",
    .acts_on = [](const SceneModel&) { return false; },
    .explain = [](const Scene& scene, const SceneModel&) -> EffectLine {
        const bool on = scene.effects.fluoroscopy;
        return {on, listed(on, "X-ray pictures beside the shaded ones")};
    },
    .in_step = false,
};

} // namespace trocar::engine::effects
