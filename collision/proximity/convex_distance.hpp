// Closest points of two convex polygons, or of any two convex hulls of a few points: what faces of more than three corners need. The
// search itself has triangles and takes the closed form of face_proximity.hpp, with which this one is compared.
// source   Gilbert, Johnson, Keerthi, "A fast procedure for computing the distance between complex objects in three-dimensional space"
//          (1988). Deviates: the point of a simplex that is nearest to the origin comes from the robust closest points of segments and
//          triangles (base/closest_point.hpp) instead of Johnson's determinants, so that flat and thin simplices are handled.
#pragma once

#include "base/vec.hpp"

#include <span>

namespace trocar::collision {

struct ConvexDistance {
    double distance = 0.0;                               // m, 0 where the hulls meet
    Vec3 point_a = Vec3::Zero(), point_b = Vec3::Zero(); // m, in the hulls up to rounding
    bool converged = true; // false: steps ran out; the distance is that of the points, and not less than the true one
};

/// a, b   at least one point each, finite (asserts)
/// error  of the distance: about 1e-14 of the hulls' extent, where they meet too
/// cost   O((a + b) steps), usually fewer than ten steps; no allocation
[[nodiscard]] ConvexDistance closest_on_convex(std::span<const Vec3> a, std::span<const Vec3> b) noexcept;

} // namespace trocar::collision
