#include "collision/search/session_parts.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>

namespace trocar::collision {
namespace {

/// Pieces smaller than this share of their surface's triangles go together: a handful of trees, however many pieces there are.
constexpr std::size_t kSmallPiece = 32;

Index find_root(std::vector<Index>& parent, Index v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
}

/// Part of each triangle: pieces in the order of their first triangles, small ones last.
std::vector<Index> find_pieces(const SurfaceTopology& topology, Index& count) {
    std::vector<Index> parent(topology.vertex_count());
    std::iota(parent.begin(), parent.end(), Index{0});
    for (const Triangle& t : topology.triangles)
        for (int k = 1; k < 3; ++k) {
            const Index a = find_root(parent, t[0]), b = find_root(parent, t[static_cast<std::size_t>(k)]);
            parent[std::max(a, b)] = std::min(a, b);
        }
    std::vector<std::size_t> size(topology.vertex_count(), 0);
    for (const Triangle& t : topology.triangles) ++size[find_root(parent, t[0])];
    std::vector<Index> number(topology.vertex_count(), kNoIndex), piece(topology.triangles.size());
    count = 0;
    bool small = false;
    for (std::size_t i = 0; i < piece.size(); ++i) {
        const Index root = find_root(parent, topology.triangles[i][0]);
        if (size[root] * kSmallPiece < topology.triangles.size()) {
            piece[i] = kNoIndex;
            small = true;
            continue;
        }
        if (number[root] == kNoIndex) number[root] = count++;
        piece[i] = number[root];
    }
    if (!small) return piece;
    std::replace(piece.begin(), piece.end(), kNoIndex, count);
    ++count;
    return piece;
}

void list_touched(SurfacePart& part) {
    const auto& tree = part.tree;
    part.touched_begin.assign(1, 0);
    for (const DopTree::Cluster& cluster : tree.clusters()) {
        const auto first = static_cast<std::ptrdiff_t>(part.touched.size());
        for (Index i = 0; i < cluster.faces.count; ++i) {
            const Index face = tree.block_ids(cluster.faces.begin + i / DopTree::kLanes)[i % DopTree::kLanes];
            for (const Index v : part.topology.triangles[face]) part.touched.push_back(part.vertex_of[v]);
        }
        std::sort(part.touched.begin() + first, part.touched.end());
        part.touched.erase(std::unique(part.touched.begin() + first, part.touched.end()), part.touched.end());
        part.touched_begin.push_back(static_cast<Index>(part.touched.size()));
    }
}

} // namespace

std::size_t SurfacePart::memory() const noexcept {
    const auto bytes = [](const auto& v) { return v.capacity() * sizeof(v[0]); };
    return tree.memory() + bytes(vertex_of) + bytes(edge_of) + bytes(face_of) + bytes(touched) + bytes(touched_begin) +
           bytes(topology.triangles) + bytes(topology.edges) + bytes(topology.triangle_edges) + bytes(topology.vertex_owner) +
           bytes(topology.edge_owner);
}

void add_parts(SurfaceIndex surface, const SurfaceTopology& topology, std::span<const Vec3> positions, std::vector<SurfacePart>& parts) {
    assert(positions.size() == topology.vertex_count());
    Index count = 0;
    const std::vector<Index> piece = find_pieces(topology, count);
    std::vector<Index> local(topology.vertex_count());
    const std::size_t first = parts.size();
    parts.resize(first + count);
    for (Index k = 0; k < count; ++k) {
        SurfacePart& part = parts[first + k];
        part.surface = surface;
        for (Index i = 0; i < piece.size(); ++i)
            if (piece[i] == k) part.face_of.push_back(i);
        for (const Index face : part.face_of)
            part.vertex_of.insert(part.vertex_of.end(), topology.triangles[face].begin(), topology.triangles[face].end());
        std::sort(part.vertex_of.begin(), part.vertex_of.end());
        part.vertex_of.erase(std::unique(part.vertex_of.begin(), part.vertex_of.end()), part.vertex_of.end());
        for (Index v = 0; v < part.vertex_of.size(); ++v) local[part.vertex_of[v]] = v;
        std::vector<Triangle> triangles;
        for (const Index face : part.face_of) {
            const Triangle& t = topology.triangles[face];
            triangles.push_back({local[t[0]], local[t[1]], local[t[2]]});
        }
        part.topology = make_topology(triangles, part.vertex_of.size());
        for (const Edge& e : part.topology.edges) {
            const Edge wanted{part.vertex_of[e[0]], part.vertex_of[e[1]]};
            const auto at = std::lower_bound(topology.edges.begin(), topology.edges.end(), wanted);
            part.edge_of.push_back(static_cast<Index>(at - topology.edges.begin()));
        }
        double length = 0.0;
        for (const Index edge : part.edge_of) length += (positions[topology.edges[edge][1]] - positions[topology.edges[edge][0]]).norm();
        if (!part.edge_of.empty()) part.edge_length = length / static_cast<double>(part.edge_of.size());
    }
}

void build_trees(std::span<SurfacePart> parts, std::span<const std::span<const Vec3>> positions, const TreeOptions& options) {
    std::vector<Vec3> local;
    for (SurfacePart& part : parts) {
        local.clear();
        for (const Index v : part.vertex_of) local.push_back(positions[part.surface][v]);
        part.tree.build(part.topology, local, options);
        list_touched(part);
    }
}

} // namespace trocar::collision
