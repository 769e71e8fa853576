// Every effect of the engine, a line each.
#pragma once

#include "engine/scene/effect.hpp"

/// The order is that of reports.
#define TROCAR_EFFECTS(effect)                                                                                                             \
    effect(elasticity)                                                                                                                     \
    effect(damping)                                                                                                                        \
    effect(gravity)                                                                                                                        \
    effect(breathing)                                                                                                                      \
    effect(loads)                                                                                                                          \
    effect(pulse)                                                                                                                          \
    effect(coarse_contact)                                                                                                                 \
    effect(self_contact)                                                                                                                   \
    effect(instrument_contact)                                                                                                             \
    effect(exact_contact)                                                                                                                  \
    effect(friction)                                                                                                                       \
    effect(twist)                                                                                                                          \
    effect(blood_drag)                                                                                                                     \
    effect(contrast)                                                                                                                       \
    effect(fluoroscopy)

namespace trocar::engine::effects {

#define TROCAR_DECLARE(name) extern const EffectDescriptor name;
TROCAR_EFFECTS(TROCAR_DECLARE)
#undef TROCAR_DECLARE

} // namespace trocar::engine::effects

namespace trocar::engine {

/// Does the model have it, and a body or instrument that it acts on?
[[nodiscard]] bool has_effect(const SceneModel& model, const EffectDescriptor& effect);

} // namespace trocar::engine
