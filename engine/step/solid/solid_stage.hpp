// Contact between solid bodies: sphere trees and surfaces under the budget, and what becomes of them.
#pragma once

#include "engine/state/step_report.hpp"
#include "engine/step/solid/solid_scratch.hpp"
#include "engine/step/tissue/tissue_scratch.hpp"
#include "engine/time/step_budget.hpp"

namespace trocar::engine {

/// What the response of solid bodies needs beside the model: the nodes beneath spheres, and depths of closed surfaces.
void prepare_solids(const SceneModel& model, const State& state, SolidScratch& solids);

/// Adds every pair of solid bodies that can touch, and whose boxes do, to the descent; and those with themselves that may.
void add_solid_pairs(const SceneModel& model, SolidScratch& solids, spheretree::Descent& descent, StepReport& report);

/// Contacts of solid pairs in solids.coarse become places that the contact solver of the next step's integration gives impulses: beneath
/// leaves the closest points of the surfaces (find_touches), where a surface has no inside those of the spheres (press_spheres), and what
/// holds the rest where the budget left it (hold_what_is_left).
/// source   seed 003, section 4: forces on the coarse vertices linked to the spheres. Deviates: the depth is the surfaces', by
///          which a body rests where its surface is, and not where its spheres bulge.
void push_solids(const SceneModel& model, State& state, SolidScratch& solids, StepReport& report, StepBudget& budget);

} // namespace trocar::engine
