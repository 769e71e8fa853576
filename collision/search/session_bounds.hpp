// Lower bounds on the distance of two features at one instant: how far their corners are apart along the direction of their nearest
// points, with the rounding of separation.hpp. What comes closer by less than the bound stays apart.
#pragma once

#include "collision/search/session_features.hpp"

namespace trocar::collision {

/// For each pair the largest distance by which all of one feature stays beyond the other along one direction, never above the truth; 0
/// where none can be proven. 2^-38 of the features' extent is taken off: what an elementary test may underestimate (sweep.hpp:
/// 1e-13), with a margin.
/// vertices, faces   where they are at that instant: t0        bounds   [pairs.size()] m, written
void bound_vertex_faces(const SurfaceMotion& vertices, const SurfaceMotion& faces, std::span<const FeaturePair> pairs,
                        std::span<double> bounds) noexcept;
void bound_edge_edges(const SurfaceMotion& a, const SurfaceMotion& b, std::span<const FeaturePair> pairs,
                      std::span<double> bounds) noexcept;

} // namespace trocar::collision
