// Detection under the budget: the traversal of the sphere trees, breadth first, and the exact stage.
#pragma once

#include "engine/step/scratch.hpp"
#include "engine/time/step_budget.hpp"

namespace trocar::engine {

/// Fills TraversalScratch::coarse: sphere pairs that touch, and those that the budget left untested.
void traverse_sphere_trees(const SceneModel& model, const EffectSet& live, State& state, SolidScratch& solids, RodsScratch& rods,
                           TraversalScratch& traversal, StepReport& report, StepBudget& budget);

/// Continuous tests of every instrument against its wall, where they fit into the budget. Fills RodsScratch::hits.
/// dropped   of choose_drops
void detect_exact_contacts(const SceneModel& model, const EffectSet& live, unsigned dropped, State& state, RodsScratch& rods,
                           StepReport& report, StepBudget& budget);

} // namespace trocar::engine
