// Pairs of features in SIMD lanes: the differences of their corners at one instant, four pairs at a time. Missing lanes repeat the first.
#pragma once

#include "base/contact.hpp"
#include "collision/ccd/features.hpp"
#include "collision/lanes.hpp"
#include "collision/topology.hpp"

#include <span>

namespace trocar::collision {

TROCAR_LANES_INLINE FeaturePair lane_pair(std::span<const FeaturePair> pairs, std::size_t lane) noexcept {
    return pairs[lane < pairs.size() ? lane : 0];
}

/// Vertex minus face corners.
/// vertices, faces   positions of the vertices' surface and of the faces'        pairs   at least one
TROCAR_LANES_INLINE std::array<Lanes3, 3> vertex_face_differences(std::span<const Vec3> vertices, std::span<const Vec3> faces,
                                                                  const SurfaceTopology& topology_of_faces,
                                                                  std::span<const FeaturePair> pairs) noexcept {
    const FeaturePair p0 = lane_pair(pairs, 0), p1 = lane_pair(pairs, 1), p2 = lane_pair(pairs, 2), p3 = lane_pair(pairs, 3);
    const std::vector<Triangle>& triangles = topology_of_faces.triangles;
    const Triangle &t0 = triangles[p0.b], &t1 = triangles[p1.b], &t2 = triangles[p2.b], &t3 = triangles[p3.b];
    const Lanes3 p = gather_points(vertices[p0.a], vertices[p1.a], vertices[p2.a], vertices[p3.a]);
    const auto corner = [&](std::size_t k) __attribute__((always_inline)) {
        return gather_points(faces[t0[k]], faces[t1[k]], faces[t2[k]], faces[t3[k]]);
    };
    return {p - corner(0), p - corner(1), p - corner(2)};
}

/// a0 - b0, a0 - b1, a1 - b0, a1 - b1.
/// a, b   positions of the two edges' surfaces        pairs   at least one
TROCAR_LANES_INLINE std::array<Lanes3, 4> edge_edge_differences(std::span<const Vec3> a, const SurfaceTopology& topology_a,
                                                                std::span<const Vec3> b, const SurfaceTopology& topology_b,
                                                                std::span<const FeaturePair> pairs) noexcept {
    const FeaturePair p0 = lane_pair(pairs, 0), p1 = lane_pair(pairs, 1), p2 = lane_pair(pairs, 2), p3 = lane_pair(pairs, 3);
    const std::vector<Edge>&edges_a = topology_a.edges, &edges_b = topology_b.edges;
    const Edge &e0 = edges_a[p0.a], &e1 = edges_a[p1.a], &e2 = edges_a[p2.a], &e3 = edges_a[p3.a];
    const Edge &f0 = edges_b[p0.b], &f1 = edges_b[p1.b], &f2 = edges_b[p2.b], &f3 = edges_b[p3.b];
    const auto end_a = [&](std::size_t k) __attribute__((always_inline)) { return gather_points(a[e0[k]], a[e1[k]], a[e2[k]], a[e3[k]]); };
    const auto end_b = [&](std::size_t k) __attribute__((always_inline)) { return gather_points(b[f0[k]], b[f1[k]], b[f2[k]], b[f3[k]]); };
    const Lanes3 a0 = end_a(0), a1 = end_a(1), b0 = end_b(0), b1 = end_b(1);
    return {a0 - b0, a0 - b1, a1 - b0, a1 - b1};
}

} // namespace trocar::collision
