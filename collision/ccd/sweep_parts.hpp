// What the continuous tests share beneath their interfaces: corner differences at a time, the plane that they come to
// lie in, the flat normal, the normal of a contact.
#pragma once

#include "collision/ccd/features.hpp"
#include "collision/ccd/nearest.hpp"
#include "collision/ccd/separation.hpp"

namespace trocar::collision {

[[nodiscard]] inline Differences<3> make_differences(const SweptPoint& vertex, const std::array<SweptPoint, 3>& face) noexcept {
    Differences<3> q; // vertex minus face corner
    for (int i = 0; i < 3; ++i) {
        q.t0[i] = vertex.t0 - face[i].t0;
        q.t1[i] = vertex.t1 - face[i].t1;
    }
    return q;
}

[[nodiscard]] inline Differences<4> make_differences(const std::array<SweptPoint, 2>& a, const std::array<SweptPoint, 2>& b) noexcept {
    Differences<4> q; // a0 - b0, a0 - b1, a1 - b0, a1 - b1
    for (int i = 0; i < 4; ++i) {
        q.t0[i] = a[i / 2].t0 - b[i % 2].t0;
        q.t1[i] = a[i / 2].t1 - b[i % 2].t1;
    }
    return q;
}

template <int Count>
[[nodiscard]] std::array<Vec3, Count> at(const Differences<Count>& q, double t) noexcept {
    std::array<Vec3, Count> out;
    for (int i = 0; i < Count; ++i) out[i] = (1.0 - t) * q.t0[i] + t * q.t1[i];
    return out;
}

/// The direction that both features lie flat across.
[[nodiscard]] inline Vec3 flat_normal(const std::array<Vec3, 3>& corner) noexcept {
    return (corner[0] - corner[1]).cross(corner[0] - corner[2]);
}
[[nodiscard]] inline Vec3 flat_normal(const std::array<Vec3, 4>& corner) noexcept {
    return (corner[2] - corner[0]).cross(corner[0] - corner[1]);
}

/// Corners of the hull in order around it, as in exact_ccd.hpp: indices into Differences.
template <int Count>
[[nodiscard]] constexpr std::array<int, Count> around() noexcept {
    if constexpr (Count == 3)
        return {0, 1, 2};
    else
        return {0, 2, 3, 1};
}

/// The coplanarity determinant and its derivative by time.
struct Plane {
    double value, slope;
};

/// Rounding of Plane.value, in units of u M^3. A position at a time is off by at most 6 u M (the difference u, two products and the
/// sum 3.01 u of at most 2 M of terms, 1 - t another); the determinant is a sum of 6 products of three such numbers, each at most M
/// (1 + 7u), off by 3 * 6 + 2 roundings, and the sums add 5 more: 6 (18 + 2 + 5) = 150.
inline constexpr double kPlaneRounding = 160.0;
/// Of a cross product's coordinate, in units of u M^2: 2 products of two numbers off by 6 u M: 2 (12 + 1) + 2 = 28.
inline constexpr double kCrossRounding = 32.0;

template <int Count>
[[nodiscard]] Plane plane_at(const Differences<Count>& q, double t) noexcept {
    constexpr auto order = around<Count>();
    std::array<Vec3, 3> x, v;
    for (std::size_t k = 0; k < 3; ++k) {
        const int i = order[k < 2 ? k : Count - 1];
        x[k] = (1.0 - t) * q.t0[i] + t * q.t1[i];
        v[k] = q.t1[i] - q.t0[i];
    }
    const Vec3 c01 = x[0].cross(x[1]);
    return {c01.dot(x[2]), c01.dot(v[2]) + x[1].cross(x[2]).dot(v[0]) + x[2].cross(x[0]).dot(v[1])};
}

/// Unit normal at contact, finite whatever came in: the shortest vector; where that is lost in rounding, the flat normal on the side
/// of the start, or against the motion.
template <int Count>
[[nodiscard]] Vec3 contact_normal(const Differences<Count>& q, double time, const Nearest& nearest) noexcept {
    const Vec3 shortest = nearest.offset / nearest.distance;
    if (nearest.distance > 1e-12 * q.magnitude && is_finite(shortest)) return shortest;
    Vec3 start = Vec3::Zero();
    Vec3 motion = Vec3::Zero();
    for (int i = 0; i < Count; ++i) {
        start += q.t0[i];
        motion += q.t1[i] - q.t0[i];
    }
    const Vec3 flat = flat_normal(at(q, time));
    const double length = flat.norm();
    if (length > 0.0 && std::isfinite(length)) {
        double side = flat.dot(start);
        if (!(std::abs(side) > 1e-12 * length * q.magnitude)) side = -flat.dot(motion);
        return side < 0.0 ? Vec3(-flat / length) : Vec3(flat / length);
    }
    const double speed = motion.norm();
    return speed > 0.0 && std::isfinite(speed) ? Vec3(-motion / speed) : Vec3::UnitX();
}

} // namespace trocar::collision
