// The response: what was found of contacts, and what was not, becomes motion that stays within the walls, and springs for the next step's
// integration.
#pragma once

#include "engine/step/scratch.hpp"
#include "engine/time/step_budget.hpp"

namespace trocar::engine {

/// After it, everything stands where the step ends. A rod that is not finite fails the step.
void resolve_contacts(const SceneModel& model, State& state, StepScratch& scratch, StepBudget& budget);

/// Contacts were left after all corrections: everything moves only as far as that is proven free. Reports the share.
void scale_to_safe_fraction(const SceneModel& model, double fraction, State& state, StepScratch& scratch);

} // namespace trocar::engine
