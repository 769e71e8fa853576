// What stands for sphere pairs of closed bodies that the budget left untested: a few bounded looks at where the two surfaces come
// nearest, and what touched in the step before.
#pragma once

#include "engine/state/step_report.hpp"
#include "engine/step/solid/solid_scratch.hpp"
#include "engine/step/solid/surface_account.hpp"

namespace trocar::engine {

/// Appends leaf pairs to solids.leaf_pairs for every pair of closed bodies with open sphere pairs: the leaves of either
/// body that lie deepest in the other, found best first with the distance to the other's surface as bound, and the pairs that
/// keep_touching kept; of two that touched in the last step the latter alone. What it finds depends on the surfaces alone and not on how far
/// the descent came, so a budget that changes from step to step does not shake a body.
/// cost      at most kProbeTests closest-point queries a step, shared among the pairs of bodies, all on the account; counted in
///           report.probe_tests
/// source    none of the papers: seed 003 (section 4) pushes by the overlap of the open spheres, whose line of centres has little
///           to do with a surface's normal (SolidResponse::Spheres does that).
/// Of bodies that solids.looked names; those whose queries the account has no room for, and those that touched, are appended to solids.left_bodies.
void probe_open_pairs(const SceneModel& model, SolidScratch& solids, StepReport& report, SurfaceAccount& account);

/// Keeps those leaf pairs of solids.leaf_pairs that a touch came from, at most kPersistentPairs of two bodies, and of those of the last step
/// what this one left.
void keep_touching(const SolidScratch& solids, std::vector<LeafPair>& kept);

/// Queries in a step; where there are so many pairs of bodies that each would get fewer than kLeastProbes, each gets these.
inline constexpr std::size_t kProbeTests = 4096, kLeastProbes = 24;
/// Leaves of either body that one look gives. A body that rests on more places gathers them over some steps.
inline constexpr std::size_t kProbedLeaves = 8;
inline constexpr std::size_t kPersistentPairs = 64;

} // namespace trocar::engine
