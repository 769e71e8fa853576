// Places of a surface as it stands: points of its triangles, where they face, and how far they came.
#pragma once

#include "base/mesh.hpp"
#include "fem/embedding/links.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

namespace trocar::engine {

[[nodiscard]] inline Vec3 point_on(const Triangle& t, const std::array<double, 3>& bary, std::span<const Vec3> positions) {
    return bary[0] * positions[t[0]] + bary[1] * positions[t[1]] + bary[2] * positions[t[2]];
}

/// Normal, outward, twice as long as the triangle is large.
[[nodiscard]] inline Vec3 twice_area(const Triangle& t, std::span<const Vec3> positions) {
    return (positions[t[1]] - positions[t[0]]).cross(positions[t[2]] - positions[t[0]]);
}

/// m; the farthest that one of the points came, rounded up. links: null, or those that do not move have no frame there.
[[nodiscard]] inline double longest_way(std::span<const Vec3> before, std::span<const Vec3> now, const fem::RigidLinks* links = nullptr) {
    double longest_sq = 0.0;
    for (std::size_t v = 0; v < now.size(); ++v)
        if (!links || links->vertex_frame[v] != kNoIndex) longest_sq = std::max(longest_sq, (now[v] - before[v]).squaredNorm());
    return std::sqrt(longest_sq) * (1.0 + 0x1p-50);
}

} // namespace trocar::engine
