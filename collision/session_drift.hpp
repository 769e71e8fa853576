// How far the features of two clusters can have moved against each other: a translation of each cluster and what its vertices stray
// from it. Neighbours on a surface move almost alike, however fast the surface is; the sum of their speeds, which a bound made of
// single movements uses, would see nothing of that.
// This work is based on: Wong, "Adaptive continuous collision detection for cloth models using a skipping frame session" (2009),
// front-end filtering. Deviates: there a pair's bound falls by both movements; here by their difference, cluster by cluster.
#pragma once

#include "base/vec.hpp"

#include <cmath>
#include <span>

namespace seldinger::collision {

/// Motion of a cluster over a step: every vertex moves by `move` and at most `spread` beside it.
struct ClusterDrift {
    Vec3 move = Vec3::Zero(); // m
    double spread = 0.0;      // m
};

/// Room for the rounding of the few operations behind each bound below, relative.
inline constexpr double kDriftRounding = 1.0 + 0x1p-40;

/// No point of a cluster moves by more against any of the other, or of its own.
[[nodiscard]] inline double relative_drift(const ClusterDrift& a, const ClusterDrift& b) noexcept {
    const double x = a.move[0] - b.move[0], y = a.move[1] - b.move[1], z = a.move[2] - b.move[2];
    return (std::sqrt(x * x + y * y + z * z) + (a.spread + b.spread)) * kDriftRounding;
}

/// Drift of some vertices between two shapes.
/// from, to   [vertex_count] m, finite
[[nodiscard]] ClusterDrift find_drift(std::span<const Vec3> from, std::span<const Vec3> to, std::span<const Index> vertices) noexcept;

} // namespace seldinger::collision
