// The last test of the broad phase, where TreeOptions::fine asks for it: two clusters along the normals of their own faces. A tube that
// lies against its vessel's wall is inside of the wall's planes, however far it slides along them, though boxes and fixed directions
// overlap.
// This work is based on: Gottschalk, Lin, Manocha, "OBBTree" (1996), separating axes. Deviates: of a hull and single triangles, over a
// step, and only along each face's normal and the line to the hull's centre; no direction is searched for.
#pragma once

#include "collision/topology.hpp"

namespace trocar::collision {

/// Faces as DopTree lays them out.
struct FaceRun {
    const Index* corners = nullptr; // [blocks][3][16] vertex ids
    Index count = 0;
};

/// Is it proven that the hull of some vertices keeps farther from each of the faces than a distance, during the whole step? For every
/// face a direction must be found along which all of the hull is beyond all of the face at t0 and at t1: differences of vertices move
/// linearly, so they are between. 2^-38 of the largest coordinate is taken off: for the rounding of a dozen operations, each 2^-53, and
/// for the distance by which the elementary tests may underestimate (sweep.hpp). Non-finite or enormous coordinates prove nothing.
/// vertices   of the hull, at most 3 DopTree::kMaxClusterSize        distance   m, >= 0
[[nodiscard]] bool hull_keeps_off(const SurfaceMotion& hull, std::span<const Index> vertices, const SurfaceMotion& surface,
                                  const FaceRun& faces, double distance) noexcept;

} // namespace trocar::collision
