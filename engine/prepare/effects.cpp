#include "engine/prepare/effects.hpp"

#include <algorithm>

namespace trocar::engine {

namespace {

template <class Has>
bool any_body(const SceneModel& model, Has has) {
    return std::any_of(model.bodies.begin(), model.bodies.end(), has);
}

bool is_damped(const BodyModel& body) {
    return body.tissue && (body.tissue->material.viscosity > 0.0 || body.tissue->material.mass_damping > 0.0);
}

/// The same tissue of a material without viscosity and drag.
void remove_damping(BodyModel& body) {
    fem::Material material = body.tissue->material;
    material.viscosity = material.mass_damping = 0.0;
    auto undamped = fem::make_tissue_model({body.tissue->rest_position, body.tissue->tet_nodes}, material, body.tissue->pinned);
    if (undamped) body.tissue = std::move(*undamped); // it succeeded once, so it succeeds again
}

/// The same rod, without angles.
void remove_torsion(fem::RodModel& rod) {
    rod.design.torsion = false;
    rod.twist_stiffness.clear();
    rod.turn_inertia.clear();
}

} // namespace

bool twists_by_effect(const InstrumentModel& instrument) noexcept {
    return instrument.rod.design.torsion && instrument.rod.design.tip != fem::TipShape::Pigtail;
}

bool has_effect(const SceneModel& model, Effect effect) noexcept {
    const EffectSet& e = model.effects;
    const bool deforms = any_body(model, [](const BodyModel& body) { return body.tissue.has_value(); });
    const bool instruments = !model.instruments.empty();
    switch (effect) {
    case Effect::Elasticity:
        return e.elasticity && deforms;
    case Effect::Damping:
        return e.elasticity && any_body(model, is_damped);
    case Effect::Gravity:
        return e.gravity && (instruments || (e.elasticity && deforms));
    case Effect::Breathing:
        return e.breathing && e.elasticity &&
               any_body(model, [](const BodyModel& body) { return body.tissue && !body.tissue->pinned.empty(); });
    case Effect::Pulse:
        return any_body(model, [](const BodyModel& body) { return !body.pulse_reach.empty(); });
    case Effect::CoarseContact:
        return e.coarse_contact;
    case Effect::SelfContact:
        return e.self_contact && any_body(model, [](const BodyModel& body) { return body.self_contact && body.links && !body.hollow; });
    case Effect::ExactContact:
        return e.exact_contact && instruments;
    case Effect::Friction:
        return model.contact.solid_friction > 0.0 ||
               std::any_of(model.instruments.begin(), model.instruments.end(), [](const InstrumentModel& i) { return i.friction > 0.0; });
    case Effect::Twist:
        return std::any_of(model.instruments.begin(), model.instruments.end(), twists_by_effect);
    case Effect::BloodDrag:
        return e.blood_drag && instruments;
    }
    return false;
}

SceneModel without_effect(const SceneModel& model, Effect effect) {
    SceneModel out = model;
    switch (effect) {
    case Effect::Elasticity:
        out.effects.elasticity = false;
        break;
    case Effect::Damping:
        for (BodyModel& body : out.bodies)
            if (is_damped(body)) remove_damping(body);
        break;
    case Effect::Gravity:
        out.effects.gravity.reset();
        break;
    case Effect::Breathing:
        out.effects.breathing.reset();
        break;
    case Effect::Pulse:
        out.effects.pulse.reset();
        if (out.effects.blood_drag) out.effects.blood_drag->pulsatility = out.effects.blood_drag->period = 0.0;
        for (BodyModel& body : out.bodies) body.pulse_reach.clear();
        break;
    case Effect::CoarseContact:
        out.effects.coarse_contact = out.effects.self_contact = false;
        break;
    case Effect::SelfContact:
        out.effects.self_contact = false;
        break;
    case Effect::ExactContact:
        out.effects.exact_contact = false;
        break;
    case Effect::Friction:
        out.contact.solid_friction = 0.0;
        for (InstrumentModel& instrument : out.instruments) instrument.friction = 0.0;
        break;
    case Effect::Twist:
        for (InstrumentModel& instrument : out.instruments)
            if (twists_by_effect(instrument)) remove_torsion(instrument.rod);
        break;
    case Effect::BloodDrag:
        out.effects.blood_drag.reset();
        for (BodyModel& body : out.bodies) body.blood.reset();
        for (InstrumentModel& instrument : out.instruments) instrument.flow_entry = 0;
        break;
    }
    return out;
}

} // namespace trocar::engine
