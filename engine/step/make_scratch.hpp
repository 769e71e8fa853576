// Scratch memory for a model, reserved for all of a step: a step allocates nothing.
#pragma once

#include "engine/step/scratch.hpp"

namespace trocar::engine {

/// Reserves what the state's lists need, too.
[[nodiscard]] StepScratch make_scratch(const SceneModel& model, State& state);

/// Room in the lists of a state that was put in place of another.
void reserve_state(const SceneModel& model, State& state);

/// What a step kept for its own speed and that holds of the state it has seen alone.
void forget_scratch(StepScratch& scratch) noexcept;

} // namespace trocar::engine
