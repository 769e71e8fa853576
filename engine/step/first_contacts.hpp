// What bodies touch before the first step.
#pragma once

#include "engine/step/scratch.hpp"

namespace trocar::engine {

/// Contacts of solid bodies where a state that no step has led to has them, found as a step finds those of the next: the first step's integration
/// meets what lies on, or comes to, a surface. Whatever the budget: it belongs to making the state ready.
void find_first_contacts(const SceneModel& model, State& state, StepScratch& scratch);

} // namespace trocar::engine
