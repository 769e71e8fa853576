// The end of a step: what it came to.
#pragma once

#include "engine/step/scratch.hpp"
#include "engine/time/step_budget.hpp"

namespace trocar::engine {

/// Closes the budget's account; takes the state over, or puts it back to the step's start where the step failed; runs the independent
/// checks, whose time is no part of the step.
const StepReport& finish_report(const SceneModel& model, State& state, const BodiesScratch& bodies, const SolidScratch& solids, RodsScratch& rods,
                                StepReport& report, StepBudget& budget);

/// Where the first instrument stands; also before the first step.
void report_first_instrument(const SceneModel& model, const State& state, StepReport& report);

} // namespace trocar::engine
