// Coulomb's friction of instruments on walls, and between solid bodies.
#include "engine/effects/describe.hpp"
#include "engine/effects/registry.hpp"

#include <fmt/format.h>

namespace trocar::engine::effects {

const EffectDescriptor friction{
    .name = "friction",
    .label = "friction",
    .doc = "Coulomb friction of instruments on walls, by each instrument's key friction; the wall feels it too.",
    .acts_on =
        [](const SceneModel& model) {
            const auto is_rough = [](const InstrumentModel& instrument) { return instrument.friction > 0.0; };
            return model.contact.solid_friction > 0.0 || std::any_of(model.instruments.begin(), model.instruments.end(), is_rough);
        },
    .remove =
        [](SceneModel& model) {
            model.contact.solid_friction = 0.0;
            for (InstrumentModel& instrument : model.instruments) instrument.friction = 0.0;
        },
    .explain = [](const Scene& scene, const SceneModel&) -> EffectLine {
        const bool on = scene.effects.friction, rough = scene.contact.solid_friction > 0.0;
        if (scene.instruments.empty() && !rough) return {false, "no instrument, and \"solid_friction\" is 0"};
        return {on, listed(on, rough ? fmt::format("Coulomb's; {:g} between solid bodies", scene.contact.solid_friction)
                                     : std::string("Coulomb's, between instruments and walls, felt by both"))};
    },
    .load_rod =
        [](const EffectStep& step, std::size_t instrument, State&, RodLoads& acting) {
            acting.friction = step.model.instruments[instrument].friction;
            if (acting.friction > 0.0) step.counts.note(friction);
        },
};

} // namespace trocar::engine::effects
