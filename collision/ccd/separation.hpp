// The proof behind every "apart": for one direction, the interval of time in which all corner differences of two features stay
// farther out along it than a distance, with the rounding of every operation accounted for.
#pragma once

#include "base/vec.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace trocar::collision {

/// Differences between the corners of two features at both ends of the step. Any pair of points of the two features differs by a
/// convex combination of these, at every time: 3 for vertex and face, 4 for edge and edge.
template <int Count>
struct Differences {
    std::array<Vec3, Count> t0, t1; // m, each the floating-point difference of two input positions
    double magnitude = 0.0;         // m, largest absolute coordinate among them

    void measure() noexcept {
        for (int i = 0; i < Count; ++i)
            for (int axis = 0; axis < 3; ++axis) magnitude = std::max({magnitude, std::abs(t0[i][axis]), std::abs(t1[i][axis])});
    }
};

/// Closed interval of time, within [0, 1]; from > to: nothing could be proven.
struct FreeTime {
    double from, to;
    [[nodiscard]] bool holds(double time) const noexcept { return from <= time && time <= to; }
};

/// Rounding error that the bound below allows, in units of u = 2^-53, times |n|_1 M, M = max |q_ik|.
/// Proof that 16 suffices. Exact values are written q, a = n . q(0), b = n . q(1); computed ones with a hat; n is exact by
/// definition. Every q^ = q (1 + e), |e| <= u, for it is one subtraction of input numbers; the products and the two sums of the
/// dot product add three more factors. Hence |a^ - a| <= g4 sum |n_k| |q_k| <= 4.01 u |n|_1 M, and so for b^.
/// For exact motion g(s) = (1 - s) a + s b, and g^(s) = (1 - s) a^ + s b^ in real arithmetic, |g^ - g| <= 4.01 u |n|_1 M on [0, 1].
/// The end of the interval is s^ = fl((a^ - B) / (a^ - b^)), three roundings: s^ = s (1 + f), |f| <= 3.01 u, where g^(s) = B exactly.
/// |g^(s^) - B| = |f| |a^ - B| <= 3.01 u 2 |n|_1 M (1 + 5u), since B lies between a^ and b^, both at most |n|_1 M (1 + 5u).
/// So at s^, and by linearity everywhere between two ends, g >= B - (6.03 + 4.01) u |n|_1 M > B - 10.1 u |n|_1 M. With
/// B >= d |n| + 15.9 u |n|_1 M (the 16 below loses at most a part of 1e-14 to its own three roundings), g > d |n| holds with a margin,
/// also against the 5 roundings in d |n|, which the factor 1 + 8u covers. Underflow adds at most 2^-1074 to each of fewer than
/// twenty operations; the smallest normal number, 2^-1022, covers them. Overflow or NaN makes B, or the comparison, fail: nothing is
/// proven.
inline constexpr double kRoundingUnits = 16.0;
inline constexpr double kUnitRoundoff = 0x1p-53;

/// When are all differences farther out than distance along n, which may have any length and any direction?
template <int Count>
[[nodiscard]] inline FreeTime find_free_time(const Differences<Count>& q, const Vec3& n, double distance) noexcept {
    constexpr FreeTime kNothing{1.0, 0.0};
    const double length_1 = std::abs(n[0]) + std::abs(n[1]) + std::abs(n[2]);
    const double length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    const double bound = distance * length * (1.0 + 8.0 * kUnitRoundoff) + kRoundingUnits * kUnitRoundoff * length_1 * q.magnitude +
                         std::numeric_limits<double>::min();
    FreeTime free{0.0, 1.0};
    for (int i = 0; i < Count; ++i) {
        const double a = n[0] * q.t0[i][0] + n[1] * q.t0[i][1] + n[2] * q.t0[i][2];
        const double b = n[0] * q.t1[i][0] + n[1] * q.t1[i][1] + n[2] * q.t1[i][2];
        if (a > bound) {
            if (b > bound) continue;
            const double end = (a - bound) / (a - b);
            if (!(end >= 0.0)) return kNothing; // NaN
            free.to = std::min(free.to, end);
        } else {
            if (!(b > bound)) return kNothing;
            const double begin = (bound - a) / (b - a);
            if (!(begin <= 1.0)) return kNothing;
            free.from = std::max(free.from, begin);
        }
    }
    return free;
}

/// A direction at either end of a piece of the step; between them it turns, linearly. Neither longer than 1 + 4u.
struct Turn {
    double from, to; // times
    Vec3 n_from, n_to;
};

/// Are all differences farther out than distance along the turning direction during the whole piece?
/// n . q_i is quadratic then, its Bernstein coefficients n0 . q0, (n0 . q1 + n1 . q0) / 2 and n1 . q1 bound it from below, and |n|
/// is at most that of its longer end. Rounding, as above: positions inside the step add 3.01 u M (two products and a sum), so a
/// coefficient is off by less than 8.1 u |n|_1 M; again 16 are allowed.
template <int Count>
[[nodiscard]] inline bool is_free_turning(const Differences<Count>& q, const Turn& turn, double distance) noexcept {
    const Vec3 &n0 = turn.n_from, &n1 = turn.n_to;
    const double length_1 = std::max(n0.lpNorm<1>(), n1.lpNorm<1>());
    const double bound = distance * (1.0 + 16.0 * kUnitRoundoff) + kRoundingUnits * kUnitRoundoff * length_1 * q.magnitude +
                         std::numeric_limits<double>::min();
    for (int i = 0; i < Count; ++i) {
        const Vec3 q0 = (1.0 - turn.from) * q.t0[i] + turn.from * q.t1[i];
        const Vec3 q1 = (1.0 - turn.to) * q.t0[i] + turn.to * q.t1[i];
        if (!(n0.dot(q0) > bound && n1.dot(q1) > bound && 0.5 * (n0.dot(q1) + n1.dot(q0)) > bound)) return false;
    }
    return true;
}

} // namespace trocar::collision
