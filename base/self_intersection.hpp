// Pairs of triangles of one surface that cross each other.
#pragma once

#include "base/mesh.hpp"

namespace trocar {

enum class Crossing : std::uint8_t {
    Proper,   // an edge of one passes through the inside of the other; touching and coplanar overlap do not count
    Touching, // any common point counts
};

struct SelfIntersections {
    std::vector<std::array<Index, 2>> pairs; // triangle ids, lower first, sorted; cut off at max_pairs
    std::size_t count = 0;                   // of all of them
    bool complete = true;                    // false: given up after max_compared, count is of what was seen by then
};

/// Pairs whose boxes overlap: a hundred times what a million-triangle scan has, some seconds of work.
inline constexpr std::size_t kMostCompared = 300'000'000;

/// Pairs of triangles without a shared vertex. Exact. Degenerate triangles take no part in Proper crossings.
/// Cost      O(n log n) on ordinary surfaces, O(n^2) where long triangles lie upon each other: see max_compared.
[[nodiscard]] SelfIntersections find_self_intersections(const TriMesh& mesh,
                                                        std::size_t max_pairs = std::numeric_limits<std::size_t>::max(),
                                                        Crossing crossing = Crossing::Proper, std::size_t max_compared = kMostCompared);

/// Does the segment pass through the inside of the triangle? Exact; touching does not count.
[[nodiscard]] bool segment_pierces(const Vec3& p, const Vec3& q, const std::array<Vec3, 3>& triangle) noexcept;

/// Exact test of two triangles, wherever they come from.
[[nodiscard]] bool triangles_cross(const std::array<Vec3, 3>& a, const std::array<Vec3, 3>& b, Crossing crossing) noexcept;

} // namespace trocar
