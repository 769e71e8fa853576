// Closest points of points, segments and triangles. Degenerate input (a triangle that is a segment or a point, parallel or
// zero-length segments) gives a closest point of what is left of it, never a NaN. NaN in gives NaN out.
#pragma once

#include "base/vec.hpp"

#include <array>

namespace trocar {

struct PointOnSegment {
    Vec3 point;         // m
    double parameter;   // [0, 1], 0 at the first end
    double distance_sq; // m^2
};

struct PointOnTriangle {
    Vec3 point;                 // m
    std::array<double, 3> bary; // weights of the corners, each in [0, 1], sum 1 up to rounding
    double distance_sq;         // m^2
};

struct PointsOnSegments {
    Vec3 point_a, point_b; // m
    double s, t;           // [0, 1] along a and along b
    double distance_sq;    // m^2
};

struct Segment {
    Vec3 from, to; // m
};

[[nodiscard]] PointOnSegment closest_on_segment(const Vec3& p, const Segment& segment) noexcept;

/// The same point to rounding for all six orders of the corners, slivers included.
/// source   Ericson, Real-Time Collision Detection (2005), section 5.1.5. Deviates: the inside region is decided by the
///          normal's cross products, and whenever that is not clear the best of the three edges answers.
[[nodiscard]] PointOnTriangle closest_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) noexcept;

/// Does the distance to its plane alone prove that the triangle is farther from p than `radius` (m)? A quarter of the work of
/// closest_on_triangle. Slivers (a sine below 1e-3), whose plane rounding turns, prove nothing.
[[nodiscard]] inline bool is_beyond_plane(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c, double radius) noexcept {
    // The normal is off by some 1e-16 / sine of its length, the height by that share of the distance to a: 1e-8 of it is plenty.
    constexpr double kLeastSine = 1e-3, kSlack = 1e-8;
    const Vec3 ab = b - a, ac = c - a, ap = p - a;
    const Vec3 normal = ab.cross(ac);
    const double height = normal.dot(ap), length_sq = normal.squaredNorm();
    return length_sq > kLeastSine * kLeastSine * ab.squaredNorm() * ac.squaredNorm() &&
           height * height > length_sq * (radius * radius + kSlack * ap.squaredNorm());
}

/// source   Ericson, section 5.1.9. Deviates: the interior pair is kept only where it beats the four end points' pairs, so
///          that nearly parallel segments lose nothing to cancellation.
[[nodiscard]] PointsOnSegments closest_on_segments(const Segment& a, const Segment& b) noexcept;

} // namespace trocar
