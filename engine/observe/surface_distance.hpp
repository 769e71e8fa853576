// How far two states of the same surface lie apart.
#pragma once

#include "base/triangle_tree.hpp"

#include <span>

namespace seldinger::engine {

struct SurfaceDistance {
    double sum_sq = 0.0; // m^2, over the vertices: from each to the same vertex of the other surface
    std::uint64_t vertices = 0;
    double hausdorff = 0.0; // m, the larger of both directions, from vertices to the other's triangles
    void join(const SurfaceDistance& other) noexcept;
    [[nodiscard]] double rms() const noexcept;
};

/// Both surfaces have these triangles. No vertex is farther from the other surface than from its own other place, so
/// vertices are asked in the order of their displacement, and those that cannot raise the maximum are not asked at all.
/// Vertices that are not finite count as infinitely far.
[[nodiscard]] SurfaceDistance measure_distance(std::span<const Triangle> triangles, std::span<const Vec3> a, std::span<const Vec3> b);

} // namespace seldinger::engine
