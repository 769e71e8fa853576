#include "base/topology.hpp"

#include <algorithm>
#include <cassert>
#include <numeric>

namespace trocar {
namespace {

/// Disjoint sets; the root of a set is its lowest member, so that results do not depend on the order of joins.
class Groups {
public:
    explicit Groups(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), Index{0}); }
    [[nodiscard]] Index root(Index i) noexcept {
        while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
        return i;
    }
    void join(Index a, Index b) noexcept {
        a = root(a);
        b = root(b);
        if (a != b) parent_[std::max(a, b)] = std::min(a, b);
    }

private:
    std::vector<Index> parent_;
};

} // namespace

std::vector<EdgeUse> sorted_edge_uses(std::span<const Triangle> triangles) {
    std::vector<EdgeUse> uses;
    uses.reserve(3 * triangles.size());
    for (std::size_t t = 0; t < triangles.size(); ++t)
        for (std::uint8_t k = 0; k < 3; ++k) {
            const Index from = triangles[t][k], to = triangles[t][(k + 1u) % 3u];
            uses.push_back({std::min(from, to), std::max(from, to), static_cast<Index>(t), k, from < to});
        }
    std::sort(uses.begin(), uses.end(), [](const EdgeUse& a, const EdgeUse& b) {
        if (a.lo != b.lo) return a.lo < b.lo;
        if (a.hi != b.hi) return a.hi < b.hi;
        return a.triangle != b.triangle ? a.triangle < b.triangle : a.corner < b.corner;
    });
    return uses;
}

std::vector<std::array<Index, 2>> unique_edges(std::span<const Triangle> triangles) {
    std::vector<std::array<Index, 2>> edges;
    edges.reserve(3 * triangles.size());
    for (const Triangle& t : triangles)
        for (std::size_t k = 0; k < 3; ++k) edges.push_back({std::min(t[k], t[(k + 1) % 3]), std::max(t[k], t[(k + 1) % 3])});
    std::sort(edges.begin(), edges.end());
    edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
    return edges;
}

std::vector<std::array<Index, 3>> triangle_neighbours(std::span<const Triangle> triangles) {
    std::vector<std::array<Index, 3>> neighbours(triangles.size(), {kNoIndex, kNoIndex, kNoIndex});
    const auto uses = sorted_edge_uses(triangles);
    for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
        if (edge.size() != 2) return;
        neighbours[edge[0].triangle][edge[0].corner] = edge[1].triangle;
        neighbours[edge[1].triangle][edge[1].corner] = edge[0].triangle;
    });
    return neighbours;
}

std::vector<std::array<Index, 3>> corner_fans(std::span<const Triangle> triangles, std::size_t vertex_count, bool across_manifold_only) {
    Groups corners(3 * triangles.size()); // corner k of triangle t is 3 t + k
    const auto uses = sorted_edge_uses(triangles);
    for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
        if (across_manifold_only && edge.size() != 2) return;
        const auto corner_at = [](const EdgeUse& use, bool low_end) {
            return 3 * use.triangle + (use.forward == low_end ? use.corner : (use.corner + 1u) % 3u);
        };
        for (const EdgeUse& use : edge.subspan(1)) {
            corners.join(corner_at(edge[0], true), corner_at(use, true));
            corners.join(corner_at(edge[0], false), corner_at(use, false));
        }
    });
    std::vector<std::array<Index, 3>> fans(triangles.size());
    std::vector<Index> fans_so_far(vertex_count, 0);
    for (Index t = 0; t < triangles.size(); ++t)
        for (Index k = 0; k < 3; ++k) {
            const Index root = corners.root(3 * t + k); // the fan's lowest corner, so numbered before it is asked for
            fans[t][k] = root == 3 * t + k ? fans_so_far[triangles[t][k]]++ : fans[root / 3][root % 3];
        }
    return fans;
}

VertexTriangles vertex_triangles(std::span<const Triangle> triangles, std::size_t vertex_count) {
    VertexTriangles out;
    out.begin.assign(vertex_count + 1, 0);
    for (const Triangle& t : triangles)
        for (const Index v : t) {
            assert(v < vertex_count);
            ++out.begin[v + 1];
        }
    std::partial_sum(out.begin.begin(), out.begin.end(), out.begin.begin());
    out.triangles.resize(3 * triangles.size());
    std::vector<Index> next(out.begin.begin(), out.begin.end() - 1);
    for (std::size_t t = 0; t < triangles.size(); ++t)
        for (const Index v : triangles[t]) out.triangles[next[v]++] = static_cast<Index>(t);
    return out;
}

Components find_components(std::span<const Triangle> triangles, std::size_t vertex_count, Joined joined) {
    Components out;
    out.of_triangle.resize(triangles.size());
    const bool by_vertex = joined == Joined::BySharedVertices;
    Groups groups(by_vertex ? vertex_count : triangles.size());
    if (by_vertex) {
        for (const Triangle& t : triangles) groups.join(t[0], t[1]), groups.join(t[1], t[2]);
    } else {
        const auto uses = sorted_edge_uses(triangles);
        for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
            for (const EdgeUse& use : edge) groups.join(edge[0].triangle, use.triangle);
        });
    }
    std::vector<Index> number(by_vertex ? vertex_count : triangles.size(), kNoIndex);
    for (std::size_t t = 0; t < triangles.size(); ++t) {
        Index& id = number[groups.root(by_vertex ? triangles[t][0] : static_cast<Index>(t))];
        if (id == kNoIndex) id = static_cast<Index>(out.count++);
        out.of_triangle[t] = id;
    }
    return out;
}

std::size_t drop_unreferenced_vertices(TriMesh& mesh) {
    std::vector<Index> new_id(mesh.vertices.size(), kNoIndex);
    for (const Triangle& t : mesh.triangles)
        for (const Index v : t) new_id[v] = 0;
    Index kept = 0;
    for (std::size_t v = 0; v < new_id.size(); ++v) {
        if (new_id[v] == kNoIndex) continue;
        mesh.vertices[kept] = mesh.vertices[v];
        new_id[v] = kept++;
    }
    const std::size_t dropped = mesh.vertices.size() - kept;
    mesh.vertices.resize(kept);
    for (Triangle& t : mesh.triangles)
        for (Index& v : t) v = new_id[v];
    return dropped;
}

double signed_volume(const TriMesh& mesh) noexcept {
    const Vec3 origin = mesh.triangles.empty() ? Vec3(Vec3::Zero()) : mesh.bounds().centre();
    double six_volumes = 0.0;
    for (const Triangle& t : mesh.triangles) {
        const Vec3 a = mesh.vertices[t[0]] - origin, b = mesh.vertices[t[1]] - origin, c = mesh.vertices[t[2]] - origin;
        six_volumes += a.dot(b.cross(c));
    }
    return six_volumes / 6.0;
}

TriMesh boundary_surface(const TetMesh& mesh) {
    struct FaceUse {
        Triangle sorted, outward;
    };
    constexpr std::array<Triangle, 4> kFaces{{{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}};
    std::vector<FaceUse> uses;
    uses.reserve(4 * mesh.tets.size());
    for (const Tet& tet : mesh.tets)
        for (const Triangle& corners : kFaces) {
            const Triangle outward{tet[corners[0]], tet[corners[1]], tet[corners[2]]};
            Triangle sorted = outward;
            std::sort(sorted.begin(), sorted.end());
            uses.push_back({sorted, outward});
        }
    std::vector<Index> by_face(uses.size());
    std::iota(by_face.begin(), by_face.end(), Index{0});
    std::sort(by_face.begin(), by_face.end(),
              [&](Index a, Index b) { return uses[a].sorted != uses[b].sorted ? uses[a].sorted < uses[b].sorted : a < b; });
    std::vector<Index> once;
    for (std::size_t i = 0; i < by_face.size();) {
        std::size_t end = i + 1;
        while (end < by_face.size() && uses[by_face[end]].sorted == uses[by_face[i]].sorted) ++end;
        if (end == i + 1) once.push_back(by_face[i]);
        i = end;
    }
    std::sort(once.begin(), once.end());
    TriMesh surface{mesh.vertices, {}};
    surface.triangles.reserve(once.size());
    for (const Index use : once) surface.triangles.push_back(uses[use].outward);
    return surface;
}

} // namespace trocar
