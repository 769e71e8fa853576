#include "engine/step/solid/normal_cone.hpp"

#include "spheretree/traverse/descent.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::engine {

namespace {

/// Cosine; across a sharper edge the surface is not a curved one in facets, but has an edge.
constexpr double kSharp = 0.82;
/// Of a cosine: rounding of what lies on a cone's side.
constexpr double kRounding = 1e-9;

Vec3 face_normal(const Triangle& t, std::span<const Vec3> positions) {
    return spheretree::direction_of((positions[t[1]] - positions[t[0]]).cross(positions[t[2]] - positions[t[0]]));
}

double sine_of(double cosine) noexcept { return std::sqrt(std::max(0.0, 1.0 - cosine * cosine)); }

} // namespace

SurfaceAdjacency make_adjacency(const collision::SurfaceTopology& topology) {
    SurfaceAdjacency out;
    out.vertex_begin.assign(topology.vertex_count() + 1, 0);
    for (const Triangle& t : topology.triangles)
        for (const Index v : t) ++out.vertex_begin[v + 1];
    for (std::size_t v = 0; v < topology.vertex_count(); ++v) out.vertex_begin[v + 1] += out.vertex_begin[v];
    out.vertex_face.resize(out.vertex_begin.back());
    std::vector<Index> next(out.vertex_begin.begin(), out.vertex_begin.end() - 1);
    for (Index face = 0; face < topology.triangles.size(); ++face)
        for (const Index v : topology.triangles[face]) out.vertex_face[next[v]++] = face;
    out.edge_faces = collision::faces_of_edges(topology);
    return out;
}

NormalCone cone_of_vertex(const SurfaceAdjacency& adjacency, const std::vector<Triangle>& triangles, Index vertex,
                          std::span<const Vec3> positions) noexcept {
    NormalCone cone;
    Vec3 sum = Vec3::Zero();
    const std::span faces(adjacency.vertex_face.data() + adjacency.vertex_begin[vertex],
                          adjacency.vertex_begin[vertex + 1] - adjacency.vertex_begin[vertex]);
    for (const Index face : faces) sum += face_normal(triangles[face], positions);
    cone.axis = spheretree::direction_of(sum);
    for (const Index face : faces) cone.cosine = std::min(cone.cosine, cone.axis.dot(face_normal(triangles[face], positions)));
    return cone;
}

Vec3 normal_of_vertex(const SurfaceAdjacency& adjacency, const std::vector<Triangle>& triangles, Index vertex,
                      std::span<const Vec3> positions) noexcept {
    Vec3 sum = Vec3::Zero();
    for (Index k = adjacency.vertex_begin[vertex]; k < adjacency.vertex_begin[vertex + 1]; ++k) {
        const Triangle& t = triangles[adjacency.vertex_face[k]];
        sum += (positions[t[1]] - positions[t[0]]).cross(positions[t[2]] - positions[t[0]]);
    }
    return spheretree::direction_of(sum);
}

NormalCone cone_of_edge(const SurfaceAdjacency& adjacency, const collision::SurfaceTopology& topology, Index v0, Index v1,
                        std::span<const Vec3> positions) noexcept {
    const Index edge = collision::find_edge(topology, v0, v1);
    return edge == kNoIndex ? NormalCone{} : cone_of_edge(adjacency, topology, edge, positions);
}

NormalCone cone_of_edge(const SurfaceAdjacency& adjacency, const collision::SurfaceTopology& topology, Index edge,
                        std::span<const Vec3> positions) noexcept {
    NormalCone cone;
    Vec3 normal[2];
    std::size_t count = 0;
    for (const Index face : adjacency.edge_faces[edge].face)
        if (face != kNoIndex) normal[count++] = face_normal(topology.triangles[face], positions);
    cone.axis = spheretree::direction_of(count == 2 ? Vec3(normal[0] + normal[1]) : normal[0]);
    for (std::size_t k = 0; k < count; ++k) cone.cosine = std::min(cone.cosine, cone.axis.dot(normal[k]));
    return cone;
}

double facet_cosine(const SurfaceAdjacency& adjacency, const collision::SurfaceTopology& topology, Index face,
                    std::span<const Vec3> positions) noexcept {
    const Vec3 own = face_normal(topology.triangles[face], positions);
    double least = 1.0;
    for (const Index edge : topology.triangle_edges[face]) {
        if (edge == kNoIndex) continue;
        for (const Index other : adjacency.edge_faces[edge].face) {
            if (other == kNoIndex || other == face) continue;
            const double cosine = own.dot(face_normal(topology.triangles[other], positions));
            if (cosine > kSharp) least = std::min(least, cosine);
        }
    }
    return least;
}

std::optional<Vec3> choose_normal(const NormalCone& own, const Vec3& out, double facet) noexcept {
    const double facing = -out.dot(own.axis);
    if (facing >= own.cosine - kRounding) return out;
    const double half_facet = std::sqrt(0.5 * (1.0 + facet)); // cosine of half of that angle
    if (own.cosine <= half_facet + kRounding) return out;     // the other surface is the flatter one
    if (facing < own.cosine * facet - sine_of(own.cosine) * sine_of(facet)) return std::nullopt;
    const Vec3 aside = -out - facing * own.axis;
    const double length = aside.norm();
    if (!(length > 0.0)) return out;
    return Vec3(-(own.cosine * own.axis + (sine_of(own.cosine) / length) * aside));
}

} // namespace trocar::engine
