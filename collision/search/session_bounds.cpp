#include "collision/search/session_bounds.hpp"

#include "collision/clones.hpp"
#include "collision/ccd/gather_pairs.hpp"
#include "collision/ccd/nearest_lanes.hpp"

#include <algorithm>
#include <limits>

namespace trocar::collision {
namespace {

/// n is taken as exact: the bound is valid for any direction. A product n . q is off by less than 4.01 u |n|_1 M (separation.hpp),
/// u = 2^-53, and |n|_1 <= 2 |n|; the root and the quotient are within a few u of themselves. Squares of a shorter n than 2^-400 lose
/// digits, so it proves nothing; nor does NaN.
template <std::size_t Count>
TROCAR_LANES_INLINE Lanes bound_of(const std::array<Lanes3, Count>& corner) noexcept {
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

TROCAR_LANES_INLINE void write(Lanes bound, std::span<double> out) noexcept {
    for (std::size_t k = 0; k < std::min<std::size_t>(kLanes, out.size()); ++k) out[k] = bound[static_cast<int>(k)];
}

} // namespace

TROCAR_CLONES
void bound_vertex_faces(const SurfaceMotion& vertices, const SurfaceMotion& faces, std::span<const FeaturePair> pairs,
                        std::span<double> bounds) noexcept {
    for (std::size_t first = 0; first < pairs.size(); first += kLanes)
        write(bound_of(vertex_face_differences(vertices.t0, faces.t0, *faces.topology, pairs.subspan(first))), bounds.subspan(first));
}

TROCAR_CLONES
void bound_edge_edges(const SurfaceMotion& a, const SurfaceMotion& b, std::span<const FeaturePair> pairs,
                      std::span<double> bounds) noexcept {
    for (std::size_t first = 0; first < pairs.size(); first += kLanes)
        write(bound_of(edge_edge_differences(a.t0, *a.topology, b.t0, *b.topology, pairs.subspan(first))), bounds.subspan(first));
}

} // namespace trocar::collision
