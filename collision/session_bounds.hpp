// Lower bounds on the distance of two features at one instant: how far their corners are apart along the direction of their nearest
// points, with the rounding of separation.hpp. What moves by less than the bound beyond a distance stays beyond that distance.
#pragma once

#include "collision/session_features.hpp"

namespace seldinger::collision {

/// Largest distance by which all of one feature stays beyond the other along one direction, never above the truth; 0 where none can be
/// proven. 2^-38 of the features' extent is taken off: what an elementary test may see nearer than it is (sweep.hpp: 1e-13), with room.
/// a, b   ids of the features in their surfaces      x, y   positions of the first and second surface
[[nodiscard]] double distance_bound(PairKind kind, Index a, Index b, const SurfaceTopology& topology_a, const SurfaceTopology& topology_b,
                                    std::span<const Vec3> x, std::span<const Vec3> y) noexcept;

} // namespace seldinger::collision
