// Continuous tests of an instrument's skin against its wall. It is a stage of the step: engine/step/traverse_trees.hpp.
#include "engine/effects/describe.hpp"
#include "engine/effects/registry.hpp"

#include <fmt/format.h>

namespace trocar::engine::effects {

const EffectDescriptor exact_contact{
    .name = "exact_contact",
    .label = "exact contact",
    .doc = "Continuous contacts, when the budget allows.",
    .acts_on = [](const SceneModel& model) { return model.effects.exact_contact && !model.instruments.empty(); },
    .remove = [](SceneModel& model) { model.effects.exact_contact = false; },
    .explain = [](const Scene& scene, const SceneModel&) -> EffectLine {
        if (scene.instruments.empty()) return {false, kNoInstrument};
        const bool on = scene.effects.exact_contact;
        return {on, listed(on, "continuous tests of the skin against the wall, when they fit in the budget")};
    },
    .floor = [](const SceneModel& model) -> std::string {
        std::size_t vertices = 0, last = model.bodies.size();
        for (const InstrumentModel& instrument : model.instruments) {
            if (instrument.lumen != last && model.bodies[instrument.lumen].moves()) vertices += model.bodies[instrument.lumen].surface.vertices.size();
            last = instrument.lumen;
        }
        const std::string pass = vertices > 0 ? fmt::format("; one pass over {} vertices of the walls, which move", vertices) : "";
        return "no continuous test, but the planes of the walls near each instrument and the solve between them" + pass +
               ": charged, not left out, and not bounded by the budget";
    },
    .scale = [](EffectSet& live, double share) { live.exact_contact = live.exact_contact && share > 0.0; },
};

} // namespace trocar::engine::effects
