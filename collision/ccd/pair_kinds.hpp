// The two kinds of pairs of features, each as four side by side and alone: iterated over by the batched sweeps and exact tests.
#pragma once

#include "collision/ccd/gather_pairs.hpp"
#include "collision/ccd/sweep_lanes.hpp"

#include <utility>

namespace trocar::collision {

TROCAR_LANES_INLINE SweptPoint swept(const SurfaceMotion& motion, Index vertex) noexcept { return {motion.t0[vertex], motion.t1[vertex]}; }
TROCAR_LANES_INLINE std::array<SweptPoint, 2> swept(const SurfaceMotion& motion, const Edge& e) noexcept {
    return {swept(motion, e[0]), swept(motion, e[1])};
}

TROCAR_LANES_INLINE std::array<SweptPoint, 3> swept(const SurfaceMotion& motion, const Triangle& t) noexcept {
    return {swept(motion, t[0]), swept(motion, t[1]), swept(motion, t[2])};
}

struct VertexFaces {
    const SurfaceMotion &vertices, &faces;

    TROCAR_LANES_INLINE LaneDifferences<3> gather(std::span<const FeaturePair> pairs) const noexcept {
        return {vertex_face_differences(vertices.t0, faces.t0, *faces.topology, pairs),
                vertex_face_differences(vertices.t1, faces.t1, *faces.topology, pairs), all(0.0)};
    }
    /// The vertex and the face.
    std::pair<SweptPoint, std::array<SweptPoint, 3>> alone(FeaturePair pair) const noexcept {
        return {swept(vertices, pair.a), swept(faces, faces.topology->triangles[pair.b])};
    }
    static Sweep sweep(const SweptPoint& vertex, const std::array<SweptPoint, 3>& face, const SweepLimits& limits) noexcept {
        return sweep_vertex_face(vertex, face, limits);
    }
};

struct EdgeEdges {
    const SurfaceMotion &a, &b;

    TROCAR_LANES_INLINE LaneDifferences<4> gather(std::span<const FeaturePair> pairs) const noexcept {
        return {edge_edge_differences(a.t0, *a.topology, b.t0, *b.topology, pairs),
                edge_edge_differences(a.t1, *a.topology, b.t1, *b.topology, pairs), all(0.0)};
    }
    std::pair<std::array<SweptPoint, 2>, std::array<SweptPoint, 2>> alone(FeaturePair pair) const noexcept {
        return {swept(a, a.topology->edges[pair.a]), swept(b, b.topology->edges[pair.b])};
    }
    static Sweep sweep(const std::array<SweptPoint, 2>& a, const std::array<SweptPoint, 2>& b, const SweepLimits& limits) noexcept {
        return sweep_edge_edge(a, b, limits);
    }
};

} // namespace trocar::collision
