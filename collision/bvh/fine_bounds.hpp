// The second test of the broad phase, where TreeOptions::fine asks for it: ten more directions, beyond the axes, for
// clusters and for single pairs of features. Axis-aligned boxes of oblique parts are mostly empty: on a catheter in its artery
// these directions leave a third of the pairs of clusters and an eighth of the pairs of features that boxes leave.
// Joined from rows of the vertices where they are wanted, so nothing but those is refitted. source   the directions of
// the 26-DOP, as in dop.hpp
#pragma once

#include "collision/bvh/dop.hpp"

#include <array>
#include <span>

namespace trocar::collision {

inline constexpr std::size_t kFineSlabs = 10;

/// lo along each direction, then minus_hi.
struct FineBounds {
    std::array<float, 2 * kFineSlabs> row;

    /// Holds nothing.
    void clear() noexcept { row.fill(SweptBox::kNothing); }
    void add(const FineBounds& other) noexcept {
        for (std::size_t i = 0; i < row.size(); ++i) row[i] = other.row[i] < row[i] ? other.row[i] : row[i];
    }
};

/// m along each direction, times the direction's length, rounded up.
using FineReach = std::array<float, kFineSlabs>;
[[nodiscard]] FineReach fine_reach(double distance) noexcept;

/// False only if they are farther apart than the reach along a direction.
[[nodiscard]] inline bool are_near(const FineBounds& a, const FineBounds& b, const FineReach& reach) noexcept {
    int apart = 0; // no branch: the loop is a few vector instructions
    for (std::size_t s = 0; s < kFineSlabs; ++s)
        apart |=
            static_cast<int>(a.row[s] + b.row[kFineSlabs + s] > reach[s]) | static_cast<int>(a.row[kFineSlabs + s] + b.row[s] > reach[s]);
    return apart == 0;
}

/// Bounds of some vertices together, while they move from t0 to t1. What is not finite, or enormous, is everywhere.
/// t0, t1   [vertex_count] m        vertices   ids
[[nodiscard]] FineBounds join_finely(std::span<const Vec3> t0, std::span<const Vec3> t1, std::span<const Index> vertices) noexcept;

/// Bounds of each vertex alone.
/// vertices   ids; their elements of out are written
/// out        [vertex_count]
void project_finely(std::span<const Vec3> t0, std::span<const Vec3> t1, std::span<const Index> vertices,
                    std::span<FineBounds> out) noexcept;

} // namespace trocar::collision
