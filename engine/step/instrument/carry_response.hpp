// Instruments between their walls where there is no time for it: what a step of a small budget does instead of planes for every place and a solve
// between them.
//
// The step ends where the rod looked ahead to, between planes of the last step that have gone along with their walls. Every other place gets planes anew
// where it ends, in the next step the others, and more of them where there is time: no plane is older than two steps.
#pragma once

#include "engine/step/instrument/instrument_scratch.hpp"
#include "engine/time/step_budget.hpp"

namespace trocar::engine {

/// False: the rod is driven far, or a place of it is found in its wall: the step has to be answered in whole.
[[nodiscard]] bool carry_response(const SceneModel& model, std::size_t instrument, State& state, RodsScratch& rods, StepReport& report, StepBudget& budget);

} // namespace trocar::engine
