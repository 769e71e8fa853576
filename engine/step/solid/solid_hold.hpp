// Forces between spheres of solid bodies, where no surface decides: the paper's penalty along the line of centres, and beside it
// the hold of open surfaces, which stands for pairs that the budget left untested.
#pragma once

#include "engine/step/solid/solid_scratch.hpp"

namespace trocar::engine {

/// Coarse nodes that each sphere of a body hangs on: the mean of its vertices as a weighted sum of nodes (the paper's set V).
[[nodiscard]] SphereNodes make_sphere_nodes(const SceneModel& model, std::size_t body);

/// Sphere pairs of solids.coarse that no surface decides become springs on the nodes of both spheres, with opposite forces.
/// Tested pairs push by their overlap. Pairs that the budget left open hold: a spring that starts without force where the two
/// spheres stand when the pair is first assumed, keeps its place for as long as the pair stays open, and resists approach
/// alone, and slipping by friction of its own. So a pair that changes its level, or comes and goes with the budget, can take energy and
/// never gives any. Of the pairs of a sphere those count that are the deepest of either sphere; the stiffness of a pair is that of the
/// leaves beneath the smaller sphere, shared among its pairs; its force ends at ContactSpec::assumed_depth of that. source   seed 003,
/// section 4. Deviates: pairs of a sphere share its stiffness where the paper averages per coarse vertex,
///          and an assumed pair holds where the paper's pushes with its overlap.
void push_spheres(const SceneModel& model, State& state, SolidScratch& solids);

} // namespace trocar::engine
