// Stage 4 of ccd.hpp: exact integer arithmetic only.
//
// At one time the features meet iff the origin lies in the convex hull of their corner differences: a triangle q0 q1 q2 (vertex minus
// each corner), or the parallelogram q0 .. q3 around a0 - b0, a1 - b0, a1 - b1, a0 - b1. Call its consecutive cross products
// c_k = q_k x q_k+1 (quadratics in t). The origin and the polygon lie in one plane where p = c_0 . q_last (a cubic) vanishes; there it
// is strictly inside iff on some axis all c_k have the same strict sign, and on the border iff for some side c_k = 0 and
// q_k . q_k+1 <= 0. A flat polygon is the union of its sides, so slivers and parallel edges need no special case.
// Where p vanishes at all times the first contact is at t = 0 or on a side: at a root of c_k, or, if that is zero at all times too,
// of q_k . q_k+1.
#pragma once

#include "collision/ccd/sweep.hpp"

#include <optional>

namespace trocar::collision {

/// Time of impact, rounded to 2^-48, or nothing.
[[nodiscard]] std::optional<double> find_exact_time(const SweptPoint& vertex, const std::array<SweptPoint, 3>& face);
[[nodiscard]] std::optional<double> find_exact_time(const std::array<SweptPoint, 2>& a, const std::array<SweptPoint, 2>& b);

} // namespace trocar::collision
