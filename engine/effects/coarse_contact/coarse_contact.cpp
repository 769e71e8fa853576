// Contacts by sphere trees. It is a stage of the step: engine/step/traverse_trees.hpp.
#include "engine/effects/describe.hpp"
#include "engine/effects/registry.hpp"

#include <fmt/format.h>

namespace trocar::engine::effects {

const EffectDescriptor coarse_contact{
    .name = "coarse_contact",
    .label = "sphere trees",
    .doc = "Contacts by sphere trees, interrupted by the budget.",
    .acts_on = [](const SceneModel& model) { return model.effects.coarse_contact; },
    .remove = [](SceneModel& model) { model.effects.coarse_contact = model.effects.self_contact = model.effects.instrument_contact = false; },
    .explain = [](const Scene& scene, const SceneModel&) -> EffectLine {
        const bool on = scene.effects.coarse_contact;
        const std::string_view trees = kSphereTreeWords[static_cast<std::size_t>(scene.contact.sphere_trees)];
        std::string files;
        for (const SceneBody& body : scene.bodies)
            if (!body.spheres.empty()) files += fmt::format("{}{} from {}", files.empty() ? "; of " : ", of ", body.name, body.spheres.filename().string());
        return {on, listed(on, fmt::format("{} sphere trees of solids, breadth-first, under the budget{}", trees, files))};
    },
    .floor = [](const SceneModel& model) -> std::string {
        std::size_t solids = 0;
        for (const BodyModel& body : model.bodies) solids += !body.hollow;
        std::string text;
        if (solids >= 2)
            text = fmt::format("the root spheres of {} solids, and of each pair that meets one hold of wholes, or at most 96 of leaf pairs; places that "
                               "pressed in the last step, from triangle to neighbouring triangle; 4 iterations of the solver in a sub-step: bounded by "
                               "bodies and such places, whatever the number of triangles",
                               solids);
        if (!model.instruments.empty())
            text += fmt::format("{}the root of each instrument's chain against its lumen's", text.empty() ? "" : "; ");
        return text;
    },
    .scale =
        [](EffectSet& live, double share) {
            live.coarse_contact = live.coarse_contact && share > 0.0;
            live.self_contact = live.self_contact && share > 0.0;
            live.instrument_contact = live.instrument_contact && share > 0.0;
        },
};

} // namespace trocar::engine::effects
