#include "engine/prepare/sharp_edges.hpp"

#include <algorithm>

namespace trocar::engine {

namespace {

/// Cosine between two faces, beyond which their edge is sharp.
constexpr double kSharpEdge = 0.94;

} // namespace

std::vector<Index> find_sharp_edges(const TriMesh& surface, const collision::SurfaceTopology& topology) {
    const std::vector<collision::EdgeFaces> faces = collision::faces_of_edges(topology);
    const std::vector<Vec3>& at = surface.vertices;
    std::vector<Index> sharp;
    for (Index e = 0; e < topology.edges.size(); ++e) {
        if (faces[e].count != 2) continue;
        const Triangle &t = topology.triangles[faces[e].face[0]], &u = topology.triangles[faces[e].face[1]];
        const Vec3 normal = (at[t[1]] - at[t[0]]).cross(at[t[2]] - at[t[0]]), beside = (at[u[1]] - at[u[0]]).cross(at[u[2]] - at[u[0]]);
        if (!(normal.dot(beside) < kSharpEdge * normal.norm() * beside.norm())) continue;
        const auto [v0, v1] = topology.edges[e];
        const auto apex = std::find_if(u.begin(), u.end(), [&](Index v) { return v != v0 && v != v1; });
        if (apex != u.end() && normal.dot(at[*apex] - at[v0]) < 0.0) sharp.push_back(e); // else a crease
    }
    return sharp;
}

} // namespace trocar::engine
