// Exact signs of orientation determinants: a floating-point filter with a proven bound first, exact expansions where it cannot
// tell. Exact as long as no product of differences under- or overflows: coordinates within 1e-70 .. 1e70, or zero.
// This work is based on: Shewchuk, "Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates" (1997).
// Deviates: two stages (filter, exact) instead of four.
#pragma once

#include "base/vec.hpp"

namespace trocar {

struct Point2 {
    double x, y;
};

/// A point seen along an axis (0 to 2): the two other coordinates, in cyclic order.
[[nodiscard]] inline Point2 drop_axis(const Vec3& p, int axis) noexcept { return {p[(axis + 1) % 3], p[(axis + 2) % 3]}; }

/// +1 if a, b, c turn counter-clockwise, -1 clockwise, 0 exactly collinear.
[[nodiscard]] int orient2d(const Point2& a, const Point2& b, const Point2& c) noexcept;

/// Sign of (b - a) . ((c - a) x (d - a)): +1 for a positively oriented tet, which is d on the side of triangle abc from which
/// it is seen counter-clockwise (where its normal points); 0 exactly coplanar.
[[nodiscard]] int orient3d(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) noexcept;

/// True if the three points are exactly collinear (coincident ones included).
[[nodiscard]] bool are_collinear(const Vec3& a, const Vec3& b, const Vec3& c) noexcept;

} // namespace trocar
