// Contact between solid bodies: sphere trees under the budget, and penalty springs on the coarse nodes of those that deform.
#pragma once

#include "engine/state/step_report.hpp"
#include "engine/step/solid/solid_scratch.hpp"
#include "engine/step/tissue/tissue_scratch.hpp"

namespace trocar::engine {

/// What the response of solid bodies needs beside the model: the nodes beneath spheres, and depths of closed surfaces.
void prepare_solids(const SceneModel& model, const State& state, SolidScratch& solids);

/// Adds every pair of solid bodies that can touch, and whose boxes do, to the descent; and those with themselves that may.
void add_solid_pairs(const SceneModel& model, SolidScratch& solids, spheretree::Descent& descent, StepReport& report);

/// Contacts of solid pairs in solids.coarse become springs on both bodies, equal and opposite, evaluated in every stage of
/// the next step's integration. Beneath leaves the closest points of the surfaces push (find_touches), and where the budget left pairs
/// open, the places that a bounded look finds (probe_open_pairs); where a surface has no inside the spheres do (push_spheres).
/// Friction, where the scene has it, is two springs along the surface for each vertex that touches, drawn by what slips and within mu times
/// what presses at any moment: what rests stays where it is. Those of edges begin anew in each step, with its last slip.
/// source   seed 003, section 4: forces on the coarse vertices linked to the spheres. Deviates: the depth is the surfaces', by
///          which a body rests where its surface is, and not where its spheres bulge.
void push_solids(const SceneModel& model, State& state, SolidScratch& solids, StepReport& report, StepBudget& budget);

/// N; sum over the springs of the last response, as the bodies stand now, of the forces that both bodies receive. Each body was
/// integrated against the other as it stood at the step's start: what is left is the price of that.
[[nodiscard]] double find_residual(const SceneModel& model, const State& state, std::span<const TissueScratch> tissue);

} // namespace trocar::engine
