// Torsion of instruments: the rod's angles (fem/rod/rod_twist.hpp).
#include "engine/effects/describe.hpp"
#include "engine/effects/registry.hpp"

namespace trocar::engine::effects {

/// Has torsion because the scene asks for it; a pigtail, a curve and what is detachable have it in any case.
static bool twists_by_effect(const InstrumentModel& instrument) noexcept {
    return instrument.rod.design.torsion && !fem::always_twists(instrument.rod.design.tip) && !instrument.detachable;
}

/// The same rod, without angles.
static void remove_torsion(fem::RodModel& rod) {
    rod.design.torsion = false;
    rod.twist_stiffness.clear();
    rod.turn_inertia.clear();
}

const EffectDescriptor twist{
    .name = "twist",
    .label = "torsion",
    .doc = "Torsion of instruments: a turn of the handle travels along them; off, it reaches the tip at once.",
    .acts_on = [](const SceneModel& model) { return std::any_of(model.instruments.begin(), model.instruments.end(), twists_by_effect); },
    .remove =
        [](SceneModel& model) {
            for (InstrumentModel& instrument : model.instruments)
                if (twists_by_effect(instrument)) remove_torsion(instrument.rod);
        },
    .explain = [](const Scene& scene, const SceneModel&) -> EffectLine {
        if (scene.instruments.empty()) return {false, kNoInstrument};
        const bool on = scene.effects.twist;
        return {on, listed(on, "torsional wind-up of instruments between the handle and what holds the tip")};
    },
    .load_rod =
        [](const EffectStep& step, std::size_t instrument, State&, RodLoads&) {
            if (twists_by_effect(step.model.instruments[instrument])) step.counts.note(twist);
        },
};

} // namespace trocar::engine::effects
