// Deformable bodies against themselves. It is part of the step's contact between solids: engine/step/solid/self_touch.hpp.
#include "engine/effects/describe.hpp"
#include "engine/effects/registry.hpp"

namespace trocar::engine::effects {

const EffectDescriptor self_contact{
    .name = "self_contact",
    .label = "self-contact",
    .doc = "Solid bodies against themselves, where their leaf spheres lay apart at rest; needs coarse_contact.",
    .acts_on =
        [](const SceneModel& model) {
            const auto may_touch = [](const BodyModel& body) { return body.self_contact && body.links && !body.hollow; };
            return model.effects.self_contact && any_body(model, may_touch);
        },
    .remove = [](SceneModel& model) { model.effects.self_contact = false; },
    .explain = [](const Scene& scene, const SceneModel& model) -> EffectLine {
        if (!any_body(model, deforms)) return {false, kNothingDeforms};
        if (!scene.effects.coarse_contact) return {false, "needs the effect coarse_contact"};
        const bool on = scene.effects.self_contact;
        return {on, listed(on, "deformable bodies against themselves, by their sphere trees")};
    },
    .floor = [](const SceneModel&) -> std::string { return "the root sphere of each such body against itself, and places that pressed in the last step"; },
};

} // namespace trocar::engine::effects
