#include "collision/sweep_batch.hpp"

#include "collision/clones.hpp"
#include "collision/gather_pairs.hpp"
#include "collision/nearest_lanes.hpp"
#include "collision/separation.hpp"

#include <algorithm>

namespace seldinger::collision {
namespace {

/// Advances of a batch before its open lanes are handed to the scalar routine: where features are to touch, it soon turns its direction.
constexpr int kBatchSteps = 4, kBatchStepsToTouch = 2;
/// As in sweep.cpp; smaller advances are left to it.
constexpr double kSmallestBatchAdvance = 0x1p-40;

template <int Count>
struct LaneDifferences {
    std::array<Lanes3, Count> t0, t1;
    Lanes size; // largest absolute coordinate among them
};

struct LaneFreeTime {
    Lanes from, to;
};

template <int Count>
SELDINGER_LANES_INLINE void measure(LaneDifferences<Count>& q) noexcept {
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
SELDINGER_LANES_INLINE std::array<Lanes3, Count> at(const LaneDifferences<Count>& q, Lanes t) noexcept {
    std::array<Lanes3, Count> out;
    for (int i = 0; i < Count; ++i) out[i] = (1.0 - t) * q.t0[i] + t * q.t1[i];
    return out;
}

SELDINGER_LANES_INLINE Lanes3 flat_normal(const std::array<Lanes3, 3>& c) noexcept { return cross(c[0] - c[1], c[0] - c[2]); }
SELDINGER_LANES_INLINE Lanes3 flat_normal(const std::array<Lanes3, 4>& c) noexcept { return cross(c[2] - c[0], c[0] - c[1]); }

/// As in separation.hpp, lane by lane; its proof holds here word for word.
template <int Count>
SELDINGER_LANES_INLINE Lanes free_bound(const LaneDifferences<Count>& q, const Lanes3& n, Lanes distance) noexcept {
    const Lanes length_1 = magnitude(n.x) + magnitude(n.y) + magnitude(n.z);
    return distance * square_root(dot(n, n)) * (1.0 + 8.0 * kUnitRoundoff) + kRoundingUnits * kUnitRoundoff * length_1 * q.size +
           std::numeric_limits<double>::min();
}

template <int Count>
SELDINGER_LANES_INLINE LaneFreeTime find_free_time(const LaneDifferences<Count>& q, const Lanes3& n, Lanes distance) noexcept {
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
SELDINGER_LANES_INLINE Mask stays_on_one_side(const LaneDifferences<Count>& q, Lanes distance) noexcept {
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
SELDINGER_LANES_INLINE void find_safe_time(const LaneDifferences<Count>& q, double distance, LaneSweep& sweep) noexcept {
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
SELDINGER_LANES_INLINE LaneSweep sweep_lanes(const LaneDifferences<Count>& q, Mask open, const SweepLimits& limits) noexcept {
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

SELDINGER_LANES_INLINE void write_lane(const LaneSweep& lanes, int lane, Sweep& sweep) noexcept {
    sweep.outcome = lanes.time[lane] > 0.0 ? SweepOutcome::Hit : SweepOutcome::StartsTouching;
    sweep.time = lanes.time[lane];
    sweep.safe_time = lanes.safe_time[lane];
    sweep.gap = lanes.nearest.distance[lane];
    for (std::size_t k = 0; k < 3; ++k) sweep.bary[k] = lanes.nearest.bary[k][lane];
    sweep.normal = lanes.nearest.offset.get(lane) / sweep.gap;
}

SELDINGER_LANES_INLINE SweptPoint swept(const SurfaceMotion& motion, Index vertex) noexcept {
    return {motion.t0[vertex], motion.t1[vertex]};
}
SELDINGER_LANES_INLINE std::array<SweptPoint, 2> swept(const SurfaceMotion& motion, const Edge& e) noexcept {
    return {swept(motion, e[0]), swept(motion, e[1])};
}

struct VertexFaces {
    const SurfaceMotion &vertices, &faces;

    SELDINGER_LANES_INLINE LaneDifferences<3> gather(std::span<const FeaturePair> pairs) const noexcept {
        return {vertex_face_differences(vertices.t0, faces.t0, *faces.topology, pairs),
                vertex_face_differences(vertices.t1, faces.t1, *faces.topology, pairs), all(0.0)};
    }
    Sweep sweep_alone(FeaturePair pair, const SweepLimits& limits) const noexcept {
        const Triangle& t = faces.topology->triangles[pair.b];
        return sweep_vertex_face(swept(vertices, pair.a), {swept(faces, t[0]), swept(faces, t[1]), swept(faces, t[2])}, limits);
    }
};

struct EdgeEdges {
    const SurfaceMotion &a, &b;

    SELDINGER_LANES_INLINE LaneDifferences<4> gather(std::span<const FeaturePair> pairs) const noexcept {
        return {edge_edge_differences(a.t0, *a.topology, b.t0, *b.topology, pairs),
                edge_edge_differences(a.t1, *a.topology, b.t1, *b.topology, pairs), all(0.0)};
    }
    Sweep sweep_alone(FeaturePair pair, const SweepLimits& limits) const noexcept {
        return sweep_edge_edge(swept(a, a.topology->edges[pair.a]), swept(b, b.topology->edges[pair.b]), limits);
    }
};

template <class Pairs>
SELDINGER_LANES_INLINE void sweep_all(const Pairs& kind, std::span<const FeaturePair> pairs, const SweepLimits& limits,
                                      std::span<Sweep> sweeps) noexcept {
    for (std::size_t first = 0; first < pairs.size(); first += kLanes) {
        auto q = kind.gather(pairs.subspan(first));
        measure(q);
        const Mask separated = stays_on_one_side(q, all(limits.distance));
        for (std::size_t k = first; k < std::min(first + kLanes, pairs.size()); ++k) sweeps[k].outcome = SweepOutcome::Separated;
        if (!any(~separated)) continue;
        const LaneSweep lanes = sweep_lanes(q, ~separated, limits);
        for (std::size_t k = first; k < std::min(first + kLanes, pairs.size()); ++k) {
            const int lane = static_cast<int>(k - first);
            if (lanes.unclear[lane])
                sweeps[k] = kind.sweep_alone(pairs[k], limits);
            else if (lanes.hit[lane])
                write_lane(lanes, lane, sweeps[k]);
        }
    }
}

} // namespace

SELDINGER_CLONES
void sweep_vertex_faces(const SurfaceMotion& vertices, const SurfaceMotion& faces, std::span<const FeaturePair> pairs,
                        const SweepLimits& limits, std::span<Sweep> sweeps) noexcept {
    sweep_all(VertexFaces{vertices, faces}, pairs, limits, sweeps);
}

SELDINGER_CLONES
void sweep_edge_edges(const SurfaceMotion& a, const SurfaceMotion& b, std::span<const FeaturePair> pairs, const SweepLimits& limits,
                      std::span<Sweep> sweeps) noexcept {
    sweep_all(EdgeEdges{a, b}, pairs, limits, sweeps);
}

} // namespace seldinger::collision
