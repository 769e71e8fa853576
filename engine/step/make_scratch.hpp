// Scratch memory for a model, reserved for all of a step: a step allocates nothing.
#pragma once

#include "engine/step/scratch.hpp"

namespace trocar::engine {

/// Reserves what the state's lists need, too.
/// like   of the same model: its trees and inside tests are copied instead of built; null: none. What they hold of the state that it has
///        seen must be forgotten
[[nodiscard]] StepScratch make_scratch(const SceneModel& model, State& state, const StepScratch* like = nullptr);

/// Room in the lists of a state that was put in place of another.
void reserve_state(const SceneModel& model, State& state);

/// What a step kept for its own speed and that holds of the state it has seen alone.
void forget_walls(RodsScratch& rods) noexcept;

} // namespace trocar::engine
