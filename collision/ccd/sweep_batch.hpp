// The elementary tests of sweep.hpp, four pairs at a time. Same proof, same answers; difficult pairs (slivers, features that
// turn while they meet, contacts that converge slowly) are handed to the scalar routine.
#pragma once

#include "collision/ccd/features.hpp"
#include "collision/ccd/sweep.hpp"
#include "collision/topology.hpp"

#include <span>

namespace trocar::collision {

/// sweeps   [pairs.size()] written; of those that are Separated only the outcome counts
void sweep_vertex_faces(const SurfaceMotion& vertices, const SurfaceMotion& faces, std::span<const FeaturePair> pairs,
                        const SweepLimits& limits, std::span<Sweep> sweeps) noexcept;
void sweep_edge_edges(const SurfaceMotion& a, const SurfaceMotion& b, std::span<const FeaturePair> pairs, const SweepLimits& limits,
                      std::span<Sweep> sweeps) noexcept;

} // namespace trocar::collision
