// Pairs of triangles of one surface that cross each other.
#pragma once

#include "base/mesh.hpp"

namespace seldinger {

enum class Crossing : std::uint8_t {
    Proper,   // an edge of one passes through the inside of the other; touching and coplanar overlap do not count
    Touching, // any common point counts
};

struct SelfIntersections {
    std::vector<std::array<Index, 2>> pairs; // triangle ids, lower first, sorted; cut off at max_pairs
    std::size_t count = 0;                   // of all of them
};

/// Pairs of triangles without a shared vertex. Exact. Degenerate triangles take no part in Proper crossings.
/// Cost      O(n log n) on ordinary surfaces.
[[nodiscard]] SelfIntersections find_self_intersections(const TriMesh& mesh,
                                                        std::size_t max_pairs = std::numeric_limits<std::size_t>::max(),
                                                        Crossing crossing = Crossing::Proper);

/// Exact test of two triangles, wherever they come from.
[[nodiscard]] bool triangles_cross(const std::array<Vec3, 3>& a, const std::array<Vec3, 3>& b, Crossing crossing) noexcept;

} // namespace seldinger
