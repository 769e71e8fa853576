// How far the features of two clusters can have come closer: what is left of their motions when a common one is taken off that brings
// nothing closer. Neighbours on a surface move almost alike, however fast the surface is; the sum of their speeds, which a bound made
// of single movements uses, ignores that.
// Two common motions are tried. A translation changes no distance. Nor does a turn w x p along straight lines make one smaller: after a
// share s of the step a difference d has become d + s w x d, whose square is |d|^2 + s^2 |w x d|^2.
// This work is based on: Wong, "Adaptive continuous collision detection for cloth models using a skipping frame session" (2009),
// front-end filtering. Deviates: there a pair's bound falls by both movements; here by what is left of their difference, cluster by
// cluster.
#pragma once

#include "base/vec.hpp"

#include <cmath>
#include <span>

namespace trocar::collision {

/// Motion of a cluster over a step: a vertex p moves by `move`, and at most `spread` beside it; and by move + turn x (p - centre), and
/// at most `residual` beside that.
struct ClusterDrift {
    Vec3 move = Vec3::Zero(); // m
    double spread = 0.0;      // m
    Vec3 turn = Vec3::Zero(); // rad
    double residual = 0.0;    // m
    Vec3 centre = Vec3::Zero();
    double radius = 0.0; // m, of the vertices about the centre at the start
};

/// Margin for the rounding of the few operations behind each bound below, relative.
inline constexpr double kDriftRounding = 1.0 + 0x1p-40;

/// No point of a cluster comes closer by more to any of the other, or of its own.
/// Of the turns, half of the difference acts on either cluster; what the common one does to their centres comes off the translation.
/// That difference may cancel: 2^-46 of its terms covers the rounding of a dozen operations.
[[nodiscard]] inline double relative_drift(const ClusterDrift& a, const ClusterDrift& b) noexcept {
    const Vec3 moves = a.move - b.move;
    const double straight = std::sqrt(moves.squaredNorm()) + (a.spread + b.spread);
    const Vec3 turn = 0.5 * a.turn + 0.5 * b.turn, apart = a.centre - b.centre;
    const double turned = std::sqrt((moves - turn.cross(apart)).squaredNorm()) + (a.residual + b.residual) +
                          0.5 * std::sqrt((a.turn - b.turn).squaredNorm()) * (a.radius + b.radius) +
                          0x1p-46 * (moves.lpNorm<1>() + turn.lpNorm<1>() * apart.lpNorm<1>());
    return (turned < straight ? turned : straight) * kDriftRounding; // NaN is not
}

/// A sum of drifts, rounded up.
[[nodiscard]] inline double add_drift(double sum, double drift) noexcept { return (sum + drift) * (1.0 + 0x1p-50); }

/// By how much less all of b is beyond all of a along a direction, at the end of the step: negative where they part. What slides across
/// the direction comes no closer along it.
/// n   unit, from a to b
[[nodiscard]] inline double drift_along(const Vec3& n, const ClusterDrift& a, const ClusterDrift& b) noexcept {
    const Vec3 moves = a.move - b.move;
    return n.dot(moves) + ((a.spread + b.spread) * kDriftRounding + 0x1p-46 * moves.lpNorm<1>());
}
/// A sum of such drifts, rounded up.
[[nodiscard]] inline double add_signed_drift(double sum, double drift) noexcept {
    return sum + drift + 0x1p-50 * (std::abs(sum) + std::abs(drift));
}

/// Drift of some vertices, at least one, between two shapes.
/// groups   as session_shapes.hpp lays them out, finite
[[nodiscard]] ClusterDrift find_drift(std::span<const double> groups) noexcept;
/// from, to   [vertex_count] m, finite        vertices   at most 3 DopTree::kMaxClusterSize
[[nodiscard]] ClusterDrift find_drift(std::span<const Vec3> from, std::span<const Vec3> to, std::span<const Index> vertices) noexcept;

} // namespace trocar::collision
