// The sweep of sweep.hpp for four pairs of features in SIMD lanes: what sweep_batch.cpp and ccd.cpp share.
#pragma once

#include "collision/lanes.hpp"
#include "collision/ccd/nearest_lanes.hpp"
#include "collision/ccd/separation.hpp"
#include "collision/ccd/sweep.hpp"

#include <array>
#include <limits>

namespace trocar::collision {

/// Advances of a batch before its open lanes are handed to the scalar routine: at distance 0, it soon turns its direction.
inline constexpr int kBatchSteps = 4, kBatchStepsToTouch = 2;
/// As in sweep.cpp; smaller advances are left to it.
inline constexpr double kSmallestBatchAdvance = 0x1p-40;

/// Differences of separation.hpp, lane by lane.
template <int Count>
struct LaneDifferences {
    std::array<Lanes3, Count> t0, t1;
    Lanes size; // largest absolute coordinate among them
};

struct LaneFreeTime {
    Lanes from, to;
};

template <int Count>
TROCAR_LANES_INLINE void measure(LaneDifferences<Count>& q) noexcept {
    q.size = all(0.0);
    const auto grow = [&q](const Lanes3& d) __attribute__((always_inline)) {
        q.size = larger(q.size, larger(magnitude(d.x), larger(magnitude(d.y), magnitude(d.z))));
    };
    for (int i = 0; i < Count; ++i) {
        grow(q.t0[i]);
        grow(q.t1[i]);
    }
}

template <int Count>
TROCAR_LANES_INLINE std::array<Lanes3, Count> at(const LaneDifferences<Count>& q, Lanes t) noexcept {
    std::array<Lanes3, Count> out;
    for (int i = 0; i < Count; ++i) out[i] = (1.0 - t) * q.t0[i] + t * q.t1[i];
    return out;
}

TROCAR_LANES_INLINE Lanes3 flat_normal(const std::array<Lanes3, 3>& c) noexcept { return cross(c[0] - c[1], c[0] - c[2]); }
TROCAR_LANES_INLINE Lanes3 flat_normal(const std::array<Lanes3, 4>& c) noexcept { return cross(c[2] - c[0], c[0] - c[1]); }

/// As in separation.hpp, lane by lane; its proof holds here word for word.
template <int Count>
TROCAR_LANES_INLINE Lanes free_bound(const LaneDifferences<Count>& q, const Lanes3& n, Lanes distance) noexcept {
    const Lanes length_1 = magnitude(n.x) + magnitude(n.y) + magnitude(n.z);
    return distance * square_root(dot(n, n)) * (1.0 + 8.0 * kUnitRoundoff) + kRoundingUnits * kUnitRoundoff * length_1 * q.size +
           std::numeric_limits<double>::min();
}

template <int Count>
TROCAR_LANES_INLINE LaneFreeTime find_free_time(const LaneDifferences<Count>& q, const Lanes3& n, Lanes distance) noexcept {
    const Lanes bound = free_bound(q, n, distance);
    const Lanes zero = all(0.0), one = all(1.0);
    LaneFreeTime free{zero, one};
    for (int i = 0; i < Count; ++i) {
        const Lanes a = dot(n, q.t0[i]), b = dot(n, q.t1[i]);
        const Mask a_free = a > bound, b_free = b > bound;
        if (!any(~(a_free & b_free))) continue;
        const Lanes cut = (a - bound) / (a - b);
        // what compares false, NaN included, proves nothing: the interval becomes empty
        free.to = b_free ? free.to : (cut >= 0.0 ? smaller(free.to, cut) : -one);
        free.from = a_free ? free.from : (cut <= 1.0 ? larger(free.from, cut) : one + one);
        free.to = a_free | b_free ? free.to : -one;
    }
    return free;
}

template <int Count>
TROCAR_LANES_INLINE Mask stays_on_one_side(const LaneDifferences<Count>& q, Lanes distance) noexcept {
    const Lanes3 flat = flat_normal(q.t0);
    const Mask below = dot(flat, q.t0[0]) < 0.0;
    const Lanes3 n = select(below, all(-1.0) * flat, flat);
    const Lanes bound = free_bound(q, n, distance);
    Mask free = {-1, -1, -1, -1};
    for (int i = 0; i < Count; ++i) free &= (dot(n, q.t0[i]) > bound) & (dot(n, q.t1[i]) > bound);
    return free;
}

struct LaneSweep {
    Mask hit, unclear; // neither: separated
    Lanes time, safe_time;
    LaneNearest nearest;
};

template <int Count>
TROCAR_LANES_INLINE void find_safe_time(const LaneDifferences<Count>& q, double distance, LaneSweep& sweep) noexcept {
    const Lanes kept = kKeptGap * smaller(sweep.nearest.distance, all(distance));
    sweep.safe_time = sweep.time;
    Mask open = sweep.hit & (kept > 0.0);
    Lanes time = sweep.time;
    LaneNearest nearest = sweep.nearest;
    for (int step = 0; step < kBatchSteps; ++step) {
        const Mask near = open & (nearest.distance <= kept + 0.5 * kept);
        sweep.safe_time = near ? time : sweep.safe_time;
        open &= ~near;
        if (!any(open)) return;
        const LaneFreeTime free = find_free_time(q, nearest.offset, kept);
        const Mask advances = open & (free.from <= time) & (free.to > time + kSmallestBatchAdvance);
        const Mask ends = open & (free.from <= time) & (free.to >= 1.0);
        sweep.unclear |= open & ~advances & ~ends;
        sweep.safe_time = ends ? all(1.0) : sweep.safe_time;
        open &= advances & ~ends;
        if (!any(open)) return;
        time = open ? free.to : time;
        nearest = find_nearest(at(q, time));
    }
    sweep.unclear |= open;
}

template <int Count>
TROCAR_LANES_INLINE LaneSweep sweep_lanes(const LaneDifferences<Count>& q, Mask open, const SweepLimits& limits) noexcept {
    const Lanes distance = all(limits.distance);
    const int steps = limits.distance + limits.tolerance > 0.0 ? kBatchSteps : kBatchStepsToTouch;
    LaneSweep sweep{};
    Lanes time = all(0.0);
    LaneNearest nearest = find_nearest(q.t0);
    for (int step = 0; step < steps && any(open); ++step) {
        const Mask near = open & (nearest.distance <= limits.distance + limits.tolerance);
        sweep.hit |= near;
        sweep.time = near ? time : sweep.time;
        sweep.nearest.offset = select(near, nearest.offset, sweep.nearest.offset);
        sweep.nearest.distance = near ? nearest.distance : sweep.nearest.distance;
        for (int k = 0; k < 3; ++k) sweep.nearest.bary[k] = near ? nearest.bary[k] : sweep.nearest.bary[k];
        open &= ~near;
        const LaneFreeTime free = find_free_time(q, nearest.offset, distance);
        const Mask holds = open & (free.from <= time);
        const Mask ends = holds & (free.to >= 1.0), advances = holds & (free.to > time + kSmallestBatchAdvance);
        sweep.unclear |= open & ~ends & ~advances;
        open &= advances & ~ends;
        if (!any(open)) break;
        time = open ? free.to : time;
        nearest = find_nearest(at(q, time));
    }
    sweep.unclear |= open;
    // without a gap worth dividing by, the scalar routine finds the normal
    sweep.unclear |= sweep.hit & ~(sweep.nearest.distance > 1e-9 * q.size);
    if (any(sweep.hit)) find_safe_time(q, limits.distance, sweep);
    return sweep;
}

} // namespace trocar::collision
