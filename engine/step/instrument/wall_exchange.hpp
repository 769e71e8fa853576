// What a rod and the tissue that carries its wall do to each other in a step.
//
// Both are solved one after the other, each against a linear answer of the other with the same stiffness k at every place that presses, so that no
// ratio of their stiffnesses lets the exchange diverge (Peaceman & Rachford 1955, Lions & Mercier 1979: both are monotone; between a fluid and
// what it moves: Robin-Robin coupling). With the wall where the last step left it, `felt` the force that it pushes back with there, and f the sum
// of what a place's planes push with:
//
//   the rod's look ahead   the place's planes move as one, by u = w + (felt - f) / k       RodPlane::give = 1/k
//   the tissue's step      feels -f - k (v - u) at its end, v: the way of the wall in this step; from -felt on, linearly; along f it pushes and never pulls
//   the rod's last solve   before the wall where it is now: u = (felt - f) / k, and felt is what the tissue felt last
//
// w is the way that the wall goes by itself: that of what holds its body (a breath, say), and of its velocity beside that the step's way by inertia's share
// of k. At rest f = felt whatever k is: k decides how
// fast both agree, not on what. It is the wall's own stiffness at the place over the step (BodyModel::node_give), shared out among the places
// that press on the same nodes. Where the rod is softer than that the planes do not give, u = w (RodPlane::give = 0).
//
// Friction: the tissue is dragged by the mean of the look ahead's and of what began the last step; in the rod's solve the wall gives way to it by
// bound / k.
#pragma once

#include "engine/step/instrument/instrument_scratch.hpp"
#include "engine/step/tissue/tissue_scratch.hpp"

namespace trocar::engine {

/// m/N; by how much a wall gives way at a place; 0: no tissue of this step carries it.
[[nodiscard]] double find_wall_give(const SceneModel& model, std::size_t lumen, const WallPress& press, const RodsScratch& rods) noexcept;

/// The same along a wall's normal, with the turns of what carries it.
[[nodiscard]] double find_exact_give(const SceneModel& model, std::size_t lumen, const WallPress& press, const Vec3& normal, const State& state,
                                     const RodsScratch& rods);

/// Planes of the last step to where their walls go by themselves, for the look ahead; without those that do not give: forces of a rod between rigid
/// planes are not the tissue's.
void move_planes(const SceneModel& model, State& state);

/// m, of a wall's place in this step.
[[nodiscard]] Vec3 find_wall_way(const SceneModel& model, std::size_t lumen, const WallPress& press, const State& state, const RodsScratch& rods);

/// Planes of the look ahead to where their walls have gone, with what the tissue felt at the step's end.
void carry_planes(const SceneModel& model, std::size_t index, State& state, const RodsScratch& rods);

/// What presses in the look ahead becomes springs on the coarse nodes that carry the walls, for this step's integration.
void push_walls(const SceneModel& model, const State& state, BodiesScratch& bodies, RodsScratch& rods);

/// m, in this step, of the wall where it presses: the mean of its triangles by their shares of the force.
[[nodiscard]] Vec3 way_of(const WallPush& push, const collision::SurfaceMotion& wall) noexcept;

/// N; what the tissue felt at the step's end, as the rod does.
/// moved   m, of way_of
[[nodiscard]] Vec3 felt_of(const WallPush& push, const Vec3& moved) noexcept;

/// N; what an instrument pushes its wall with at the step's end, less what the tissue felt of it then; 0: both agree, or no tissue carries the wall.
[[nodiscard]] double find_exchange_gap(const SceneModel& model, std::size_t instrument, const State& state, const RodsScratch& rods);

} // namespace trocar::engine
