// Nearest points of the origin and a hull of corner differences, fast: the sweeps only need a direction from it, so a sliver may
// get a poor one; base/closest_point.hpp has the robust routines, which the sweeps fall back on.
// source   Ericson, Real-Time Collision Detection (2005), sections 5.1.5 and 5.1.9
#pragma once

#include "base/closest_point.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace trocar::collision {

/// Nearest points of the two features at one time.
struct Nearest {
    Vec3 offset;                // m, from face to vertex, from b to a
    double distance;            // m, of the offset: never below the true distance by more than rounding
    std::array<double, 3> bary; // as in Sweep
};

/// corner   vertex minus each corner of the face
[[nodiscard]] inline Nearest find_nearest(const std::array<Vec3, 3>& corner) noexcept {
    const Vec3 &a = corner[0], &b = corner[1], &c = corner[2];
    const Vec3 ab = b - a, ac = c - a;
    const auto answer = [&](double v, double w) -> Nearest {
        const Vec3 offset = a + v * ab + w * ac;
        return {offset, offset.norm(), {1.0 - v - w, v, w}};
    };
    const double d1 = -ab.dot(a), d2 = -ac.dot(a);
    if (d1 <= 0.0 && d2 <= 0.0) return answer(0.0, 0.0);
    const double d3 = -ab.dot(b), d4 = -ac.dot(b);
    if (d3 >= 0.0 && d4 <= d3) return answer(1.0, 0.0);
    const double vc = d1 * d4 - d3 * d2;
    if (vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 && d1 > d3) return answer(d1 / (d1 - d3), 0.0);
    const double d5 = -ab.dot(c), d6 = -ac.dot(c);
    if (d6 >= 0.0 && d5 <= d6) return answer(0.0, 1.0);
    const double vb = d5 * d2 - d1 * d6;
    if (vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 && d2 > d6) return answer(0.0, d2 / (d2 - d6));
    const double va = d3 * d6 - d5 * d4;
    if (va <= 0.0 && d4 >= d3 && d5 >= d6 && (d4 - d3) + (d5 - d6) > 0.0) {
        const double w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return answer(1.0 - w, w);
    }
    const double sum = va + vb + vc;
    if (!(sum > 0.0)) return answer(0.0, 0.0);
    return answer(vb / sum, vc / sum);
}

/// corner   a0 - b0, a0 - b1, a1 - b0, a1 - b1
[[nodiscard]] inline Nearest find_nearest(const std::array<Vec3, 4>& corner) noexcept {
    const Vec3& r = corner[0];
    const Vec3 da = corner[2] - corner[0], db = corner[0] - corner[1];
    const double aa = da.squaredNorm(), bb = db.squaredNorm(), ab = da.dot(db), ar = da.dot(r), br = db.dot(r);
    const auto ratio = [](double p, double q) { return p <= 0.0 || q <= 0.0 ? 0.0 : p >= q ? 1.0 : p / q; };
    double s = ratio(ab * br - ar * bb, aa * bb - ab * ab);
    double t = ratio(ab * s + br, bb);
    if (t <= 0.0) s = ratio(-ar, aa);
    if (t >= 1.0) s = ratio(ab - ar, aa);
    const Vec3 offset = r + s * da - t * db;
    return {offset, offset.norm(), {s, t, 0.0}};
}

/// The same, robust for degenerate and nearly parallel features.
[[nodiscard]] inline Nearest find_nearest_robustly(const std::array<Vec3, 3>& corner) noexcept {
    const PointOnTriangle on = closest_on_triangle(Vec3::Zero(), corner[0], corner[1], corner[2]);
    return {on.point, std::sqrt(on.distance_sq), on.bary};
}
[[nodiscard]] inline Nearest find_nearest_robustly(const std::array<Vec3, 4>& corner) noexcept {
    const PointsOnSegments on = closest_on_segments({corner[0], corner[2]}, {Vec3::Zero(), corner[0] - corner[1]});
    return {on.point_a - on.point_b, std::sqrt(on.distance_sq), {on.s, on.t, 0.0}};
}

} // namespace trocar::collision
