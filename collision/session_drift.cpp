#include "collision/session_drift.hpp"

#include "collision/dop_tree.hpp"

#include <algorithm>
#include <array>

namespace seldinger::collision {

/// A displacement is one subtraction of inputs, so off by u of itself in each coordinate, u = 2^-53; the distance to the translation
/// that is then measured adds one more subtraction, and a root of three squares, four more factors 1 + u. 2^-48 of the largest
/// displacement and kDriftRounding cover them with room. Overflow gives infinity, which bounds everything.
ClusterDrift find_drift(std::span<const Vec3> from, std::span<const Vec3> to, std::span<const Index> vertices) noexcept {
    std::array<Vec3, 3 * DopTree::kMaxClusterSize> moved; // left uninitialised
    Vec3 lo = to[vertices[0]] - from[vertices[0]], hi = lo;
    for (std::size_t i = 0; i < vertices.size(); ++i) {
        moved[i] = to[vertices[i]] - from[vertices[i]];
        lo = lo.cwiseMin(moved[i]);
        hi = hi.cwiseMax(moved[i]);
    }
    ClusterDrift drift;
    drift.move = 0.5 * lo + 0.5 * hi;
    double largest_sq = 0.0;
    for (std::size_t i = 0; i < vertices.size(); ++i) largest_sq = std::max(largest_sq, (moved[i] - drift.move).squaredNorm());
    const double size = lo.cwiseAbs().cwiseMax(hi.cwiseAbs()).maxCoeff();
    drift.spread = std::sqrt(largest_sq) * kDriftRounding + 0x1p-48 * size + 0x1p-500;
    if (!std::isfinite(drift.spread) || !is_finite(drift.move)) return {Vec3::Zero(), std::numeric_limits<double>::infinity()};
    return drift;
}

} // namespace seldinger::collision
