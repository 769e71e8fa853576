// How far two states of the same surface lie apart.
#pragma once

#include "base/triangle_tree.hpp"

#include <span>

namespace trocar::engine {

struct SurfaceDistance {
    double sum_sq = 0.0;        // m^2, over the vertices of both: from each to the nearest point of the other surface
    std::uint64_t vertices = 0; // of both
    double hausdorff = 0.0;     // m, the largest of those distances
    void join(const SurfaceDistance& other) noexcept;
    /// m, root mean square of those distances: never above `hausdorff`.
    [[nodiscard]] double rms() const noexcept;
};

/// Both surfaces have these triangles. No vertex is farther from the other surface than from its own other place: nothing beyond that is
/// searched, and vertices that did not move are skipped. A vertex that slides along the other surface is not away from it.
/// Vertices that are not finite count as infinitely far.
[[nodiscard]] SurfaceDistance measure_distance(std::span<const Triangle> triangles, std::span<const Vec3> a, std::span<const Vec3> b);

} // namespace trocar::engine
