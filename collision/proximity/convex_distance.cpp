#include "collision/proximity/convex_distance.hpp"

#include "base/closest_point.hpp"

#include <algorithm>
#include <array>
#include <cassert>

namespace trocar::collision {
namespace {

/// A corner of the hull of all differences a - b.
struct Corner {
    Vec3 difference; // m
    std::size_t a, b;
};

std::size_t farthest_along(std::span<const Vec3> points, const Vec3& direction) noexcept {
    std::size_t best = 0;
    for (std::size_t i = 1; i < points.size(); ++i)
        if (direction.dot(points[i]) > direction.dot(points[best])) best = i;
    return best;
}

/// At most four corners, and the weights of their point that is nearest to the origin.
struct Simplex {
    std::array<Corner, 4> corners;
    std::array<double, 4> weights{1.0, 0.0, 0.0, 0.0};
    std::size_t count = 0;

    [[nodiscard]] Vec3 nearest() const noexcept {
        Vec3 point = Vec3::Zero();
        for (std::size_t i = 0; i < count; ++i) point += weights[i] * corners[i].difference;
        return point;
    }
    [[nodiscard]] bool has(const Corner& corner) const noexcept {
        for (std::size_t i = 0; i < count; ++i)
            if (corners[i].a == corner.a && corners[i].b == corner.b) return true;
        return false;
    }
    /// Corners that carry no weight are dropped.
    void drop_idle() noexcept {
        std::size_t kept = 0;
        for (std::size_t i = 0; i < count; ++i)
            if (weights[i] > 0.0) {
                corners[kept] = corners[i];
                weights[kept++] = weights[i];
            }
        count = kept;
    }
    /// The nearest point of triangle i, k, l where it beats the best.
    void take_triangle(std::size_t i, std::size_t k, std::size_t l, double& best_sq, std::array<double, 4>& best) const noexcept {
        const PointOnTriangle on = closest_on_triangle(Vec3::Zero(), corners[i].difference, corners[k].difference, corners[l].difference);
        if (!(on.distance_sq < best_sq)) return;
        best_sq = on.distance_sq;
        best = {};
        best[i] = on.bary[0];
        best[k] = on.bary[1];
        best[l] = on.bary[2];
    }
    void find_nearest() noexcept {
        const auto& c = corners;
        double best_sq = std::numeric_limits<double>::infinity();
        std::array<double, 4> best{1.0, 0.0, 0.0, 0.0};
        if (count == 2) {
            const double t = closest_on_segment(Vec3::Zero(), {c[0].difference, c[1].difference}).parameter;
            best = {1.0 - t, t, 0.0, 0.0};
        } else if (count == 3) {
            take_triangle(0, 1, 2, best_sq, best);
        } else if (count == 4 && !find_inside(best)) {
            take_triangle(0, 1, 2, best_sq, best);
            take_triangle(0, 1, 3, best_sq, best);
            take_triangle(0, 2, 3, best_sq, best);
            take_triangle(1, 2, 3, best_sq, best);
        }
        weights = best;
    }
    /// Is the origin in the tetrahedron? Then its weights are shares of the volume.
    [[nodiscard]] bool find_inside(std::array<double, 4>& inside) const noexcept {
        const Vec3 &p = corners[0].difference, &q = corners[1].difference, &r = corners[2].difference, &s = corners[3].difference;
        const double whole = (q - p).cross(r - p).dot(s - p);
        const std::array<double, 4> parts{q.cross(r).dot(s), -p.cross(r).dot(s), p.cross(q).dot(s), -p.cross(q).dot(r)};
        for (const double part : parts)
            if (!(part * whole > 0.0)) return false;
        for (std::size_t i = 0; i < 4; ++i) inside[i] = parts[i] / whole;
        return true;
    }
};

} // namespace

ConvexDistance closest_on_convex(std::span<const Vec3> a, std::span<const Vec3> b) noexcept {
    assert(!a.empty() && !b.empty());
    constexpr int kMostSteps = 64;
    constexpr double kRounding = 1e-15; // of the largest difference's length: nearer than ten times it is contact, a gain below it is none
    Simplex simplex;
    simplex.corners[simplex.count++] = {a[0] - b[0], 0, 0};
    double size = simplex.corners[0].difference.norm();
    double last = std::numeric_limits<double>::infinity();
    bool converged = false;
    for (int step = 0; step < kMostSteps && !converged; ++step) {
        simplex.find_nearest();
        simplex.drop_idle();
        const Vec3 nearest = simplex.nearest();
        const std::size_t i = farthest_along(a, -nearest), k = farthest_along(b, nearest);
        const Corner corner{a[i] - b[k], i, k};
        // no difference lies farther towards the origin than the nearest point: it is the hull's
        size = std::max(size, corner.difference.norm());
        const double length = nearest.norm(), gain = length * length - nearest.dot(corner.difference);
        // a step that comes no nearer is the end of what rounding allows
        converged = simplex.count == 4 || simplex.has(corner) || length <= 10.0 * kRounding * size || gain <= kRounding * length * size ||
                    length >= last;
        last = length;
        if (!converged) {
            simplex.weights[simplex.count] = 0.0;
            simplex.corners[simplex.count++] = corner;
        }
    }
    if (!converged) {
        simplex.find_nearest();
        simplex.drop_idle();
    }
    ConvexDistance out;
    out.converged = converged;
    for (std::size_t i = 0; i < simplex.count; ++i) {
        out.point_a += simplex.weights[i] * a[simplex.corners[i].a];
        out.point_b += simplex.weights[i] * b[simplex.corners[i].b];
    }
    out.distance = simplex.count == 4 ? 0.0 : simplex.nearest().norm(); // four: the origin is inside
    return out;
}

} // namespace trocar::collision
