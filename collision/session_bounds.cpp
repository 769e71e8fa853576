#include "collision/session_bounds.hpp"

#include "collision/clones.hpp"
#include "collision/nearest_lanes.hpp"

#include <algorithm>
#include <limits>

namespace seldinger::collision {
namespace {

/// n is taken as exact: any direction proves what it proves. A product n . q is off by less than 4.01 u |n|_1 M (separation.hpp),
/// u = 2^-53, and |n|_1 <= 2 |n|; the root and the quotient are within a few u of themselves. Squares of a shorter n than 2^-400 lose
/// digits, so it proves nothing; nor does NaN.
template <std::size_t Count>
SELDINGER_LANES_INLINE Lanes bound_of(const std::array<Lanes3, Count>& corner) noexcept {
    const LaneNearest nearest = find_nearest(corner);
    Lanes least = all(std::numeric_limits<double>::max()), size = all(0.0);
    for (const Lanes3& q : corner) {
        least = smaller(least, dot(nearest.offset, q));
        size = larger(size, larger(magnitude(q.x), larger(magnitude(q.y), magnitude(q.z))));
    }
    const Lanes bound = least / nearest.distance * (1.0 - 0x1p-40) - 0x1p-38 * size;
    const Mask proven = (bound > 0.0) & (bound < 1e100) & (nearest.distance > 0x1p-400);
    return proven ? bound : all(0.0);
}

SELDINGER_LANES_INLINE FeaturePair lane_pair(std::span<const FeaturePair> pairs, int lane) noexcept {
    return pairs[static_cast<std::size_t>(lane) < pairs.size() ? static_cast<std::size_t>(lane) : 0];
}

SELDINGER_LANES_INLINE Lanes3 nought() noexcept { return {all(0.0), all(0.0), all(0.0)}; }

SELDINGER_LANES_INLINE void write(Lanes bound, std::span<double> out) noexcept {
    for (std::size_t k = 0; k < std::min<std::size_t>(kLanes, out.size()); ++k) out[k] = bound[static_cast<int>(k)];
}

} // namespace

SELDINGER_CLONES
void bound_vertex_faces(const SurfaceMotion& vertices, const SurfaceMotion& faces, std::span<const FeaturePair> pairs,
                        std::span<double> bounds) noexcept {
    for (std::size_t first = 0; first < pairs.size(); first += kLanes) {
        Lanes3 p = nought();
        std::array<Lanes3, 3> f{p, p, p};
        for (int lane = 0; lane < kLanes; ++lane) {
            const FeaturePair pair = lane_pair(pairs.subspan(first), lane);
            const Triangle& t = faces.topology->triangles[pair.b];
            p.set(lane, vertices.t0[pair.a]);
            for (std::size_t k = 0; k < 3; ++k) f[k].set(lane, faces.t0[t[k]]);
        }
        write(bound_of<3>({p - f[0], p - f[1], p - f[2]}), bounds.subspan(first));
    }
}

SELDINGER_CLONES
void bound_edge_edges(const SurfaceMotion& a, const SurfaceMotion& b, std::span<const FeaturePair> pairs,
                      std::span<double> bounds) noexcept {
    for (std::size_t first = 0; first < pairs.size(); first += kLanes) {
        std::array<Lanes3, 2> x{nought(), nought()}, y = x;
        for (int lane = 0; lane < kLanes; ++lane) {
            const FeaturePair pair = lane_pair(pairs.subspan(first), lane);
            const Edge &e = a.topology->edges[pair.a], &f = b.topology->edges[pair.b];
            for (std::size_t k = 0; k < 2; ++k) {
                x[k].set(lane, a.t0[e[k]]);
                y[k].set(lane, b.t0[f[k]]);
            }
        }
        write(bound_of<4>({x[0] - y[0], x[0] - y[1], x[1] - y[0], x[1] - y[1]}), bounds.subspan(first));
    }
}

} // namespace seldinger::collision
