// What stands for surfaces that the budget left: places beneath their spheres that come no nearer to one another.
#pragma once

#include "engine/state/step_report.hpp"
#include "engine/step/solid/solid_scratch.hpp"

namespace trocar::engine {

/// Appends to solids.touches and solids.wholes, for every two closed bodies with anything that the budget left (is_left), what holds them where they are.
/// Pairs of leaves, the kMostHeld deepest: a vertex of the first body and a triangle of the second, with a gap of 0, along the triangle's
/// normal. Pairs of larger spheres: the two bodies as wholes (SolidContact::room). The contact solver takes what speed of approach they
/// have, and no more: they part freely, nothing is stored, momentum is kept, and what is left in one step and looked at in the next changes
/// nothing but what was approaching. Bodies so stand farther apart than their surfaces would, by the size of the spheres.
/// source  Mendoza & O'Sullivan 2005 treat open pairs as contacts likewise, and push by the depth of their spheres (SolidResponse::Spheres).
void hold_what_is_left(const SceneModel& model, const State& state, SolidScratch& solids, StepReport& report);

/// The sphere-tree paper's response (SolidResponse::Spheres): every sphere of two bodies pushes at its deepest pair, along the line of centres,
/// from the overlap of the two; pairs that the budget left open hold their bodies as wholes.
/// Fills solids.sphere_places, one a vertex, the deepest.
/// Deviates: the paper's penalty, a spring from each overlap evaluated once a step, gains energy and lets bodies through; the same places at
/// the same depths go to the contact solver. Without restitution, and bodies rest where their spheres meet.
void press_spheres(const SceneModel& model, const State& state, SolidScratch& solids, StepReport& report);

inline constexpr std::ptrdiff_t kMostHeld = 96;

} // namespace trocar::engine
