// One step: what moves freely, then what is known of contacts, then the response. Every stage takes its own part of the state and of the
// scratch.
#pragma once

#include "engine/state/inputs.hpp"
#include "engine/state/state.hpp"
#include "engine/step/scratch.hpp"
#include "engine/time/step_budget.hpp"

namespace trocar::engine {

/// All that the budget does not decide: drive commands, tissue, embedded surfaces, sphere trees, the free motion of instruments.
/// False: that failed, and finish_step only reports it.
bool begin_step(const SceneModel& model, const Inputs& inputs, State& state, StepScratch& scratch, StepBudget& budget);

/// Traversal of the sphere trees, exact contacts where the budget allows, and the response. After a step that failed the state is the one
/// before it.
const StepReport& finish_step(const SceneModel& model, State& state, StepScratch& scratch, StepBudget& budget);

} // namespace trocar::engine
