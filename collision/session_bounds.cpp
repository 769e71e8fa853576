#include "collision/session_bounds.hpp"

#include "collision/nearest.hpp"

namespace seldinger::collision {
namespace {

/// n is taken as exact: any direction proves what it proves. A product n . q is off by less than 4.01 u |n|_1 M (separation.hpp),
/// u = 2^-53, and |n|_1 <= 2 |n|; the root and the quotient are within a few u of themselves.
template <std::size_t Count>
double bound_of(const std::array<Vec3, Count>& corner) noexcept {
    const Vec3 n = find_nearest(corner).offset;
    const double length = n.norm();
    double least = std::numeric_limits<double>::infinity(), size = 0.0;
    for (const Vec3& q : corner) {
        least = std::min(least, n.dot(q));
        size = std::max(size, q.cwiseAbs().maxCoeff());
    }
    const double bound = least / length * (1.0 - 0x1p-40) - 0x1p-38 * size;
    return bound > 0.0 && length > 0x1p-400 && std::isfinite(bound) ? bound : 0.0; // NaN is not
}

double vertex_face(const Vec3& p, const Triangle& t, std::span<const Vec3> faces) noexcept {
    return bound_of<3>({p - faces[t[0]], p - faces[t[1]], p - faces[t[2]]});
}

} // namespace

double distance_bound(PairKind kind, Index a, Index b, const SurfaceTopology& topology_a, const SurfaceTopology& topology_b,
                      std::span<const Vec3> x, std::span<const Vec3> y) noexcept {
    if (kind == PairKind::VertexFace) return vertex_face(x[a], topology_b.triangles[b], y);
    if (kind == PairKind::FaceVertex) return vertex_face(y[a], topology_a.triangles[b], x);
    const Edge &e = topology_a.edges[a], &f = topology_b.edges[b];
    return bound_of<4>({x[e[0]] - y[f[0]], x[e[0]] - y[f[1]], x[e[1]] - y[f[0]], x[e[1]] - y[f[1]]});
}

} // namespace seldinger::collision
