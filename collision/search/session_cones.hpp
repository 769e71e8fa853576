// Heuristic: regions of low curvature that are not tested against themselves. The cone of a region holds its triangles' normals during
// the whole step; where it is narrow, a surface cannot fold onto itself, unless its outline does. The contour test that would make it
// exact is not made, so contacts may be lost: `bench seed004` counts them, and exact answers keep it off.
// This work is based on: Provot, "Collision and self-collision handling in cloth model dedicated to design garments" (1997); Tang, Curtis,
// Yoon, Manocha, "ICCD: interactive continuous collision detection between deformable models using connectivity-based culling" (2009),
// continuous normal cones. Deviates: regions are nodes of the tree, merged bottom-up while they are narrow.
#pragma once

#include "collision/search/session_parts.hpp"

namespace trocar::collision {

/// Region of each cluster of a part: the topmost node above it whose cone has a half angle below a quarter turn less a margin. Clusters
/// that are not narrow themselves have none: kNoIndex.
/// motion    of the part's surface
/// regions   [cluster_count] written; numbers count from `first`; returns the next number
Index find_flat_regions(const SurfacePart& part, const SurfaceMotion& motion, Index first, std::span<Index> regions);

} // namespace trocar::collision
