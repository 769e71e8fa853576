#include "collision/topology.hpp"

#include <algorithm>
#include <cassert>

namespace trocar::collision {
namespace {

Edge make_edge(Index a, Index b) { return a < b ? Edge{a, b} : Edge{b, a}; }

std::vector<Edge> sorted_edges(std::span<const Triangle> triangles) {
    std::vector<Edge> edges;
    edges.reserve(3 * triangles.size());
    for (const Triangle& t : triangles)
        for (int k = 0; k < 3; ++k)
            if (t[k] != t[(k + 1) % 3]) edges.push_back(make_edge(t[k], t[(k + 1) % 3]));
    std::sort(edges.begin(), edges.end());
    edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
    return edges;
}

} // namespace

SurfaceTopology make_topology(std::span<const Triangle> triangles, std::size_t vertex_count) {
    SurfaceTopology topology;
    topology.triangles.assign(triangles.begin(), triangles.end());
    topology.edges = sorted_edges(triangles);
    topology.vertex_owner.assign(vertex_count, kNoIndex);
    topology.edge_owner.assign(topology.edges.size(), kNoIndex);
    topology.triangle_edges.resize(triangles.size());
    for (Index id = 0; id < triangles.size(); ++id) {
        const Triangle& t = triangles[id];
        for (int k = 0; k < 3; ++k) {
            assert(t[k] < vertex_count);
            if (topology.vertex_owner[t[k]] == kNoIndex) topology.vertex_owner[t[k]] = id;
            const Index edge = find_edge(topology, t[k], t[(k + 1) % 3]);
            topology.triangle_edges[id][k] = edge;
            if (edge != kNoIndex && topology.edge_owner[edge] == kNoIndex) topology.edge_owner[edge] = id;
        }
    }
    return topology;
}

Index find_edge(const SurfaceTopology& topology, Index v0, Index v1) noexcept {
    const Edge wanted = make_edge(v0, v1);
    const auto found = std::lower_bound(topology.edges.begin(), topology.edges.end(), wanted);
    return found != topology.edges.end() && *found == wanted ? static_cast<Index>(found - topology.edges.begin()) : kNoIndex;
}

std::vector<EdgeFaces> faces_of_edges(const SurfaceTopology& topology) {
    std::vector<EdgeFaces> out(topology.edges.size());
    for (Index id = 0; id < topology.triangles.size(); ++id)
        for (const Index edge : topology.triangle_edges[id]) {
            if (edge == kNoIndex) continue;
            EdgeFaces& faces = out[edge];
            if (faces.count < faces.face.size()) faces.face[faces.count] = id;
            ++faces.count;
        }
    return out;
}

} // namespace trocar::collision
