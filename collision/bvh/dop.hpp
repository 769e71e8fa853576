// Discrete oriented polytopes: k/2 slabs across fixed directions, in single precision, rounded outwards.
// source   Klosowski, Held, Mitchell, Sowizral, Zikan, "Efficient collision detection using bounding volume hierarchies of
//          k-DOPs" (1998); directions with components in {-1, 0, 1}.
#pragma once

#include "collision/swept_box.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <span>

namespace trocar::collision {

/// Slabs of 6-, 14-, 18- and 26-DOPs.
inline constexpr std::size_t kMaxSlabs = 13;
[[nodiscard]] constexpr bool is_dop(std::size_t k) noexcept { return k == 6 || k == 14 || k == 18 || k == 26; }

/// Directions, as x, y, z factors: the axes, then the 4 corners (14), the 6 edges (18), or both (26).
using Directions = std::span<const std::array<int, 3>>;
inline constexpr std::array<std::array<int, 3>, 13> kCornerDirections{{
    {1, 0, 0},
    {0, 1, 0},
    {0, 0, 1},
    {1, 1, 1},
    {1, 1, -1},
    {1, -1, 1},
    {1, -1, -1},
    {1, 1, 0},
    {1, 0, 1},
    {0, 1, 1},
    {1, -1, 0},
    {1, 0, -1},
    {0, 1, -1},
}};
inline constexpr std::array<std::array<int, 3>, 9> kEdgeDirections{{
    {1, 0, 0},
    {0, 1, 0},
    {0, 0, 1},
    {1, 1, 0},
    {1, 0, 1},
    {0, 1, 1},
    {1, -1, 0},
    {1, 0, -1},
    {0, 1, -1},
}};
[[nodiscard]] inline Directions directions_of(std::size_t k) noexcept {
    return k == 18 ? Directions(kEdgeDirections) : Directions(kCornerDirections).first(k / 2);
}

/// Length of a direction, not below the true one.
[[nodiscard]] inline double direction_length(const std::array<int, 3>& n) noexcept {
    return std::sqrt(static_cast<double>(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])) * (1.0 + 0x1p-50);
}

/// Writes lo[s] and minus_hi[s] of a vertex that moves from t0 to t1; the upper ends are stored negated, so that one minimum joins
/// and one sum is a gap. What is not finite, or enormous, is everywhere.
/// A projection of three terms is off by at most 2^-52 (|x| + |y| + |z|); 2^-50 of that is taken off first.
inline void project_vertex(const Vec3& t0, const Vec3& t1, Directions directions, float* lo, float* minus_hi) noexcept {
    const double size0 = std::abs(t0[0]) + std::abs(t0[1]) + std::abs(t0[2]), size1 = std::abs(t1[0]) + std::abs(t1[1]) + std::abs(t1[2]);
    if (!(size0 <= kLargestCoordinate && size1 <= kLargestCoordinate)) {
        for (std::size_t s = 0; s < directions.size(); ++s) lo[s] = minus_hi[s] = -SweptBox::kNothing;
        return;
    }
    for (std::size_t s = 0; s < 3; ++s) {
        const auto axis = static_cast<Eigen::Index>(s);
        lo[s] = round_down(t0[axis] < t1[axis] ? t0[axis] : t1[axis]);
        minus_hi[s] = round_down(t0[axis] < t1[axis] ? -t1[axis] : -t0[axis]);
    }
    const double error = 0x1p-50 * (size0 > size1 ? size0 : size1);
    for (std::size_t s = 3; s < directions.size(); ++s) {
        const auto& n = directions[s];
        const double a = n[0] * t0[0] + n[1] * t0[1] + n[2] * t0[2], b = n[0] * t1[0] + n[1] * t1[1] + n[2] * t1[2];
        lo[s] = round_down((a < b ? a : b) - error);
        minus_hi[s] = round_down((a < b ? -b : -a) - error);
    }
}

} // namespace trocar::collision
