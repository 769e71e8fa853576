#include "collision/search/session_drift.hpp"

#include "collision/clones.hpp"
#include "collision/bvh/dop_tree.hpp"
#include "collision/search/session_shapes.hpp"

#include <algorithm>
#include <array>

namespace trocar::collision {
namespace {

constexpr std::size_t kMostGroups = (3 * DopTree::kMaxClusterSize + kLanes - 1) / kLanes;

TROCAR_LANES_INLINE Lanes3 everywhere(const Vec3& v) noexcept { return {all(v[0]), all(v[1]), all(v[2])}; }
TROCAR_LANES_INLINE double sum(Lanes x) noexcept { return (x[0] + x[1]) + (x[2] + x[3]); }
TROCAR_LANES_INLINE double largest(Lanes x) noexcept { return std::max(std::max(x[0], x[1]), std::max(x[2], x[3])); }
TROCAR_LANES_INLINE Vec3 mean(const Lanes3& sums, double share) noexcept {
    return {share * sum(sums.x), share * sum(sums.y), share * sum(sums.z)};
}

/// The turn that explains most of what the vertices stray from the translation, by least squares; none where they do not tell.
TROCAR_LANES_INLINE Vec3 find_turn(std::span<const Lanes3> arms, std::span<const Lanes3> strays) noexcept {
    Lanes xx = all(0.0), xy = xx, xz = xx, yy = xx, yz = xx, zz = xx;
    Lanes3 momentum{xx, xx, xx};
    for (std::size_t i = 0; i < arms.size(); ++i) {
        const Lanes3& r = arms[i];
        xx += r.x * r.x;
        xy += r.x * r.y;
        xz += r.x * r.z;
        yy += r.y * r.y;
        yz += r.y * r.z;
        zz += r.z * r.z;
        momentum = momentum + cross(r, strays[i]);
    }
    // inverse of the tensor of inertia by its cofactors
    const double a = sum(yy) + sum(zz), b = -sum(xy), c = -sum(xz), d = sum(xx) + sum(zz), e = -sum(yz), f = sum(xx) + sum(yy);
    const double ca = d * f - e * e, cb = c * e - b * f, cc = b * e - c * d, cd = a * f - c * c, ce = b * c - a * e, cf = a * d - b * b;
    const double determinant = a * ca + b * cb + c * cc, size = sum(xx) + sum(yy) + sum(zz);
    if (!(determinant > 1e-9 * size * size * size)) return {0.0, 0.0, 0.0}; // all on a line, or in one point
    const double x = sum(momentum.x), y = sum(momentum.y), z = sum(momentum.z), scale = 1.0 / determinant;
    const Vec3 turn{scale * (ca * x + cb * y + cc * z), scale * (cb * x + cd * y + ce * z), scale * (cc * x + ce * y + cf * z)};
    const double square = turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2];
    if (!(square < 1e100)) return {0.0, 0.0, 0.0}; // NaN is not
    return turn;
}

} // namespace

/// Whatever translation, turn and centre come out here (vertices that fill up the last group count twice in them), they are exact
/// numbers; only what the vertices stray from them must be bounded.
/// A displacement is one subtraction of inputs, so off by u of itself in each coordinate, u = 2^-53; so is an arm. The distance to what
/// is predicted adds a cross product, two sums, three squares and a root: less than 16 u of the terms. 2^-46 of the largest ones and
/// kDriftRounding cover them with a margin. Overflow gives infinity, which bounds everything.
TROCAR_CLONES
ClusterDrift find_drift(std::span<const double> rows) noexcept {
    Lanes3 strays[kMostGroups], arms[kMostGroups]; // left uninitialised
    const std::size_t groups = rows.size() / kShapeGroup;
    const Lanes none = all(0.0);
    Lanes3 moves{none, none, none}, centres = moves;
    Lanes size = none;
    for (std::size_t g = 0; g < groups; ++g) {
        const double* row = rows.data() + g * kShapeGroup;
        const Lanes3 start{load_lanes(row), load_lanes(row + kLanes), load_lanes(row + 2 * kLanes)};
        const Lanes3 end{load_lanes(row + 3 * kLanes), load_lanes(row + 4 * kLanes), load_lanes(row + 5 * kLanes)};
        arms[g] = start;
        strays[g] = end - start;
        moves = moves + strays[g];
        centres = centres + start;
        size = larger(size, larger(magnitude(strays[g].x), larger(magnitude(strays[g].y), magnitude(strays[g].z))));
    }
    ClusterDrift drift;
    const double most = largest(size);
    drift.radius = std::numeric_limits<double>::infinity();
    if (most == 0.0) return drift; // stands still: no turn to share
    const double share = 1.0 / static_cast<double>(groups * kLanes);
    drift.move = mean(moves, share);
    drift.centre = mean(centres, share);
    const Lanes3 move = everywhere(drift.move), centre = everywhere(drift.centre);
    for (std::size_t g = 0; g < groups; ++g) {
        arms[g] = arms[g] - centre;
        strays[g] = strays[g] - move;
    }
    drift.turn = find_turn({arms, groups}, {strays, groups});
    const Lanes3 turn = everywhere(drift.turn);
    Lanes spread_sq = none, residual_sq = none, radius_sq = none;
    for (std::size_t g = 0; g < groups; ++g) {
        const Lanes3 left = strays[g] - cross(turn, arms[g]);
        spread_sq = larger(spread_sq, dot(strays[g], strays[g]));
        residual_sq = larger(residual_sq, dot(left, left));
        radius_sq = larger(radius_sq, dot(arms[g], arms[g]));
    }
    constexpr double kTiny = 0x1p-500; // squares below it vanish
    const double turned = std::abs(drift.turn[0]) + std::abs(drift.turn[1]) + std::abs(drift.turn[2]);
    drift.radius = std::sqrt(largest(radius_sq)) * kDriftRounding + kTiny;
    drift.spread = std::sqrt(largest(spread_sq)) * kDriftRounding + 0x1p-46 * most + kTiny;
    drift.residual = std::sqrt(largest(residual_sq)) * kDriftRounding + 0x1p-46 * (most + turned * drift.radius) + kTiny;
    const double total = drift.spread + drift.residual + drift.radius + std::abs(drift.move[0]) + std::abs(drift.move[1]) +
                         std::abs(drift.move[2]) + std::abs(drift.centre[0]) + std::abs(drift.centre[1]) + std::abs(drift.centre[2]);
    if (!(total < std::numeric_limits<double>::infinity())) { // NaN is not
        drift = ClusterDrift();
        drift.spread = drift.residual = drift.radius = std::numeric_limits<double>::infinity();
    }
    return drift;
}

ClusterDrift find_drift(std::span<const Vec3> from, std::span<const Vec3> to, std::span<const Index> vertices) noexcept {
    std::array<double, kMostGroups * kShapeGroup> groups; // left uninitialised
    const auto used = std::span(groups).first((vertices.size() + kLanes - 1) / kLanes * kShapeGroup);
    gather_shape(from, to, vertices, used);
    return find_drift(used);
}

} // namespace trocar::collision
