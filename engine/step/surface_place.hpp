// Places of a surface as it stands: points of its triangles, and where they face.
#pragma once

#include "base/mesh.hpp"

#include <array>
#include <span>

namespace seldinger::engine {

[[nodiscard]] inline Vec3 point_on(const Triangle& t, const std::array<double, 3>& bary, std::span<const Vec3> positions) {
    return bary[0] * positions[t[0]] + bary[1] * positions[t[1]] + bary[2] * positions[t[2]];
}

/// Normal, outward, twice as long as the triangle is large.
[[nodiscard]] inline Vec3 twice_area(const Triangle& t, std::span<const Vec3> positions) {
    return (positions[t[1]] - positions[t[0]]).cross(positions[t[2]] - positions[t[0]]);
}

} // namespace seldinger::engine
