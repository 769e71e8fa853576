// How the engine goes about its effects: calls a hook of one in a step, takes one out of a model.
#pragma once

#include "engine/prepare/model.hpp"

namespace trocar::engine {

/// Of the engine's effects always: they test what is live by themselves. Of the program's own where the step simulates them, with their
/// settings.
template <class Hook>
void call(const EffectDescriptor& effect, const EffectStep& step, Hook hook) {
    if (effect.acts_on != nullptr) return hook(step);
    const std::vector<AddedEffect>& all = step.model.effects.added;
    for (const AddedEffect& added : step.live.added) {
        if (added.effect != &effect) continue;
        std::size_t index = 0;
        while (index < all.size() && all[index].effect != &effect) ++index;
        hook(EffectStep{step.model, step.live, added.settings, step.time_t1, step.counts, index});
    }
}

/// What preparing the same scene without the effect gives, but for self_contact and instrument_contact without coarse_contact and contrast without
/// blood_drag, which go with it.
[[nodiscard]] SceneModel without_effect(const SceneModel& model, const EffectDescriptor& effect);

} // namespace trocar::engine
