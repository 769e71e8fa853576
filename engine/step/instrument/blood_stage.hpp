// Blood drag: how the blood flows around an instrument in this step.
#pragma once

#include "engine/state/step_report.hpp"
#include "engine/step/instrument/instrument_scratch.hpp"

namespace trocar::engine {

/// Fills the flow of every instrument's scratch, where the effect is: the profile of Poiseuille around the centreline where the
/// vessels stand now, seen from where the rods stand at the start of the step. Nodes before the port feel nothing.
/// cost      O(node_count), some tens of centreline points a node
void find_blood_flow(const SceneModel& model, State& state, RodsScratch& rods, StepReport& report);

} // namespace trocar::engine
