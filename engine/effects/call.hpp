// Calls a hook of an effect in a step.
#pragma once

#include "engine/prepare/model.hpp"

namespace trocar::engine {

/// Of the engine's effects always: they test what is live by themselves. Of the program's own where the step simulates them, with their
/// settings.
template <class Hook>
void call(const EffectDescriptor& effect, const EffectStep& step, Hook hook) {
    if (effect.acts_on != nullptr) return hook(step);
    for (const AddedEffect& added : step.live.added)
        if (added.effect == &effect) hook(EffectStep{step.model, step.live, added.settings, step.time_t1, step.counts});
}

} // namespace trocar::engine
