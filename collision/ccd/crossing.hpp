// Where features first lie in one plane, and whether they meet there: four pairs in SIMD lanes, decided without sweeping the step.
//
// Features that meet lie in one plane, where the determinant of three corner differences is zero: a cubic in time. With its Bernstein
// coefficients b0 .. b3 on the step, Descartes' rule of signs counts: all of one sign, it has no root and the features never meet; one
// change of sign, it has one, and they meet there or nowhere. So one test at that time is a proof either way: the sign changes around
// it, and for all of that while the origin is inside the hull of the differences, or all of them are beyond it along one direction.
// Other pairs (several changes, a coefficient too close to zero where it matters, a contact at a corner or border) stay undecided.
// source   the coplanarity cubic: Provot, "Collision and self-collision handling in cloth model dedicated to design garments" (1997);
//          signs of its Bernstein coefficients: Tang, Tong, Wang, Manocha, "Fast and exact continuous collision detection with
//          Bernstein sign classification" (2014). Deviates: verdicts here are proven in floating point, other pairs are left undecided.
#pragma once

#include "collision/ccd/ccd_result.hpp"
#include "collision/ccd/sweep_lanes.hpp"
#include "collision/ccd/sweep_parts.hpp"

namespace trocar::collision {

/// Newton's steps, or halvings where those leave the bracket, to the root; a root not close enough by then stays undecided.
inline constexpr int kRootSteps = 6;

struct LaneCrossing {
    Mask apart, meets;   // neither: unclear
    Lanes time;          // where they meet
    LaneNearest nearest; // then
    Lanes3 normal;       // unit, on the side where they started
};

/// The cubic, by powers of time, and its Bernstein coefficients.
struct LaneCubic {
    std::array<Lanes, 4> bernstein, power;

    [[nodiscard]] TROCAR_LANES_INLINE Lanes value(Lanes t) const noexcept {
        return power[0] + t * (power[1] + t * (power[2] + t * power[3]));
    }
    [[nodiscard]] TROCAR_LANES_INLINE Lanes slope(Lanes t) const noexcept { return power[1] + t * (2.0 * power[2] + t * (3.0 * power[3])); }
};

/// The three differences whose determinant is zero where the features lie in one plane, as in plane_at().
template <int Count>
TROCAR_LANES_INLINE std::array<Lanes3, 3> plane_corners(const std::array<Lanes3, Count>& corner) noexcept {
    constexpr auto order = around<Count>();
    return {corner[order[0]], corner[order[1]], corner[order[Count - 1]]};
}

TROCAR_LANES_INLINE Lanes determinant(const std::array<Lanes3, 3>& x) noexcept { return dot(cross(x[0], x[1]), x[2]); }

/// Each coefficient is off by less than kPlaneRounding u M^3: a determinant is 6 products of three differences, each off by u, with 5
/// more roundings: 48; the mean of three of them adds 2 roundings of terms that are 18 together, and a division: 66.
template <int Count>
TROCAR_LANES_INLINE LaneCubic find_cubic(const LaneDifferences<Count>& q) noexcept {
    const std::array<Lanes3, 3> p = plane_corners<Count>(q.t0), r = plane_corners<Count>(q.t1);
    const Lanes3 p01 = cross(p[0], p[1]), p12 = cross(p[1], p[2]), p20 = cross(p[2], p[0]);
    const Lanes3 r01 = cross(r[0], r[1]), r12 = cross(r[1], r[2]), r20 = cross(r[2], r[0]);
    const Lanes b0 = dot(p01, p[2]), b1 = (dot(p01, r[2]) + dot(p12, r[0]) + dot(p20, r[1])) / 3.0;
    const Lanes b2 = (dot(r01, p[2]) + dot(r12, p[0]) + dot(r20, p[1])) / 3.0, b3 = dot(r01, r[2]);
    return {{b0, b1, b2, b3}, {b0, 3.0 * (b1 - b0), 3.0 * (b0 - 2.0 * b1 + b2), b3 - 3.0 * b2 + 3.0 * b1 - b0}};
}

/// Near the one root between 0 and 1: a guess, on which the proof does not depend.
TROCAR_LANES_INLINE Lanes guess_root(const LaneCubic& cubic) noexcept {
    const Lanes first = cubic.bernstein[0];
    Lanes low = all(0.0), high = all(1.0), t = first / (first - cubic.bernstein[3]);
    for (int step = 0; step < kRootSteps; ++step) {
        const Lanes value = cubic.value(t);
        const Mask before = (value > 0.0) == (first > 0.0);
        low = before ? t : low;
        high = before ? high : t;
        const Lanes next = t - value / cubic.slope(t);
        t = (next >= low) & (next <= high) ? next : 0.5 * (low + high);
    }
    return t;
}

/// As stays_inside() of ccd_fallback.cpp, with its bound.
template <int Count>
TROCAR_LANES_INLINE Mask stay_inside(const std::array<Lanes3, Count>& corner, Lanes size, Lanes reach) noexcept {
    constexpr auto order = around<Count>();
    const Lanes m2 = size * size, bound = kCrossRounding * kUnitRoundoff * m2 + 8.0 * m2 * reach * (1.0 + 1e-9);
    Mask xp = {-1, -1, -1, -1}, xn = xp, yp = xp, yn = xp, zp = xp, zn = xp;
    for (int k = 0; k < Count; ++k) {
        const Lanes3 c = cross(corner[order[k]], corner[order[(k + 1) % Count]]);
        xp &= c.x > bound, xn &= c.x < -bound;
        yp &= c.y > bound, yn &= c.y < -bound;
        zp &= c.z > bound, zn &= c.z < -bound;
    }
    return xp | xn | yp | yn | zp | zn;
}

/// As contact_normal() where no gap is left: the flat normal on the side of the start, or against the motion.
template <int Count>
TROCAR_LANES_INLINE Lanes3 flat_contact_normal(const LaneDifferences<Count>& q, const std::array<Lanes3, Count>& corner) noexcept {
    const Lanes3 flat = flat_normal(corner);
    Lanes3 start = q.t0[0], end = q.t1[0];
    for (int i = 1; i < Count; ++i) {
        start = start + q.t0[i];
        end = end + q.t1[i];
    }
    const Lanes length = square_root(dot(flat, flat)), side = dot(flat, start), motion = dot(flat, end - start);
    const Lanes out = magnitude(side) > 1e-12 * length * q.size ? side : -motion;
    return (out < 0.0 ? -1.0 / length : 1.0 / length) * flat;
}

template <int Count>
TROCAR_LANES_INLINE LaneCrossing find_crossing(const LaneDifferences<Count>& q) noexcept {
    const LaneCubic cubic = find_cubic(q);
    const auto& [b0, b1, b2, b3] = cubic.bernstein;
    const Lanes bound = kPlaneRounding * kUnitRoundoff * q.size * q.size * q.size + std::numeric_limits<double>::min();
    LaneCrossing crossing{};
    crossing.apart =
        ((b0 > bound) & (b1 > bound) & (b2 > bound) & (b3 > bound)) | ((b0 < -bound) & (b1 < -bound) & (b2 < -bound) & (b3 < -bound));
    const Mask falls = (b0 > bound) & (b3 < -bound) & ((b1 > bound) | (b2 < -bound)); // one change of sign, whatever the uncertain one
    const Mask rises = (b0 < -bound) & (b3 > bound) & ((b1 < -bound) | (b2 > bound));
    if (!any(falls | rises)) return crossing;

    const Lanes t = guess_root(cubic);
    const Lanes reach = larger(4.0 * bound / magnitude(cubic.slope(t)), all(0x1p-50));
    const Lanes from = t - reach, to = t + reach;
    const Lanes before = determinant(plane_corners<Count>(at(q, from))), after = determinant(plane_corners<Count>(at(q, to)));
    const Mask holds_root = (reach < kTimeOfImpactError) & (from >= 0.0) & (to <= 1.0) &
                            ((falls & (before > bound) & (after < -bound)) | (rises & (before < -bound) & (after > bound)));
    const auto corner = at(q, t);
    crossing.time = t;
    crossing.nearest = find_nearest(corner);
    crossing.normal = flat_contact_normal<Count>(q, corner);
    crossing.meets = holds_root & stay_inside<Count>(corner, q.size, reach + 0x1p-52) & (crossing.nearest.distance <= 1e-9 * q.size);
    const LaneFreeTime free = find_free_time(q, crossing.nearest.offset, all(0.0));
    crossing.apart |= holds_root & (free.from <= from) & (free.to >= to);
    return crossing;
}

} // namespace trocar::collision
