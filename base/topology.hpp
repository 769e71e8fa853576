// What a mesh is made of and what is wrong with it: edges, adjacency, components, and one report per mesh kind.
#pragma once

#include "base/mesh.hpp"
#include "base/result.hpp"

#include <span>

namespace trocar {

/// Counts of everything that closed, manifold, oriented surfaces have none of. Vertices that no triangle uses are not
/// counted as defects. Indices out of range are counted in degenerate_triangles, and such triangles are left out of all else.
struct SurfaceReport {
    std::size_t vertices = 0, triangles = 0;
    std::size_t boundary_edges = 0;       // used by one triangle
    std::size_t nonmanifold_edges = 0;    // used by three or more
    std::size_t inconsistent_edges = 0;   // used by two that run through it the same way
    std::size_t degenerate_triangles = 0; // repeated or out-of-range index, or exactly no area
    std::size_t duplicate_triangles = 0;  // same three vertices as an earlier one, in any order
    std::size_t non_finite_vertices = 0;
    std::size_t nonmanifold_vertices = 0; // triangles around it form more than one fan (edges counted above set aside)
    std::size_t unreferenced_vertices = 0;
    std::size_t components = 0;       // of triangles, joined by shared vertices
    double signed_volume = 0.0;       // m^3, sum over triangles; a volume for closed surfaces only
    std::vector<Index> bad_triangles; // up to 8 ids: degenerate, non-manifold, inconsistent, border ones, in this order

    [[nodiscard]] bool closed() const noexcept { return triangles > 0 && boundary_edges == 0; }
    [[nodiscard]] bool manifold() const noexcept {
        return nonmanifold_edges == 0 && nonmanifold_vertices == 0 && degenerate_triangles == 0 && duplicate_triangles == 0;
    }
    [[nodiscard]] bool oriented() const noexcept { return inconsistent_edges == 0; }
    [[nodiscard]] bool finite() const noexcept { return non_finite_vertices == 0; }
};

[[nodiscard]] SurfaceReport inspect_surface(const TriMesh& mesh);

/// An Error that names the first defect and up to 8 triangles, unless the surface is finite, closed, manifold, consistently
/// oriented and encloses a positive volume. Self-intersections are not searched for.
[[nodiscard]] Result<void> check_closed_surface(const TriMesh& mesh);

struct TetMeshReport {
    std::size_t nodes = 0, tets = 0;
    std::size_t inverted_tets = 0; // negative volume
    std::size_t flat_tets = 0;     // volume exactly 0, or a repeated index
    std::size_t out_of_range_tets = 0;
    std::size_t duplicate_tets = 0; // same four nodes as an earlier one
    std::size_t overused_faces = 0; // shared by three or more tets
    std::size_t unreferenced_nodes = 0;
    std::size_t non_finite_nodes = 0;
    std::size_t components = 0;  // of tets, joined by shared nodes
    double volume = 0.0;         // m^3, signed sum
    std::vector<Index> bad_tets; // up to 8 ids: out of range, inverted, flat, duplicate ones

    [[nodiscard]] bool valid() const noexcept {
        return tets > 0 && inverted_tets + flat_tets + out_of_range_tets + duplicate_tets + overused_faces + non_finite_nodes == 0;
    }
};

[[nodiscard]] TetMeshReport inspect_tets(const TetMesh& mesh);

/// Faces used by exactly one tet, outward for positively oriented tets. Vertices are the tet mesh's own, all of them, so
/// that ids agree. Triangles in the order of their tets.
[[nodiscard]] TriMesh boundary_surface(const TetMesh& mesh);

/// Vertex pairs, lower id first, sorted, each once.
[[nodiscard]] std::vector<std::array<Index, 2>> unique_edges(std::span<const Triangle> triangles);

/// One triangle's use of one edge.
struct EdgeUse {
    Index lo, hi; // vertex ids
    Index triangle;
    std::uint8_t corner; // the edge runs from this corner to the next
    bool forward;        // from lo to hi
};

/// All 3 uses of every triangle, sorted by (lo, hi, triangle, corner): uses of one edge are neighbours.
[[nodiscard]] std::vector<EdgeUse> sorted_edge_uses(std::span<const Triangle> triangles);

/// Calls visit(span of the uses of one edge) for each edge, by ascending vertex ids.
template <class Visit>
void for_each_edge(std::span<const EdgeUse> sorted_uses, Visit&& visit) {
    for (std::size_t begin = 0; begin < sorted_uses.size();) {
        std::size_t end = begin + 1;
        while (end < sorted_uses.size() && sorted_uses[end].lo == sorted_uses[begin].lo && sorted_uses[end].hi == sorted_uses[begin].hi)
            ++end;
        visit(sorted_uses.subspan(begin, end - begin));
        begin = end;
    }
}

/// [triangle][k]: the triangle across the edge from corner k to k + 1; kNoIndex at a border and where 3 or more meet.
[[nodiscard]] std::vector<std::array<Index, 3>> triangle_neighbours(std::span<const Triangle> triangles);

/// [triangle][k]: number of the fan that corner k belongs to among its vertex's fans, 0-based. A fan is a run of triangles
/// around the vertex that are joined across edges; with across_manifold_only, only across edges of exactly two triangles.
[[nodiscard]] std::vector<std::array<Index, 3>> corner_fans(std::span<const Triangle> triangles, std::size_t vertex_count,
                                                            bool across_manifold_only);

/// Triangles around each vertex, ascending ids, in one array.
struct VertexTriangles {
    std::vector<Index> begin;     // [vertex_count + 1]
    std::vector<Index> triangles; // [3 triangle_count]
    [[nodiscard]] std::span<const Index> of(Index vertex) const noexcept {
        return {triangles.data() + begin[vertex], triangles.data() + begin[vertex + 1]};
    }
};
[[nodiscard]] VertexTriangles vertex_triangles(std::span<const Triangle> triangles, std::size_t vertex_count);

enum class Joined : std::uint8_t { BySharedVertices, BySharedEdges };
struct Components {
    std::vector<Index> of_triangle; // [triangle_count] component id; numbered by their lowest triangle
    std::size_t count = 0;
};
[[nodiscard]] Components find_components(std::span<const Triangle> triangles, std::size_t vertex_count,
                                         Joined joined = Joined::BySharedVertices);

/// Removes vertices that no triangle uses; the others keep their order. Returns how many went.
std::size_t drop_unreferenced_vertices(TriMesh& mesh);

/// Sum over triangles of det(a, b, c) / 6 about the box centre: the enclosed volume of a closed surface, positive if outward.
[[nodiscard]] double signed_volume(const TriMesh& mesh) noexcept;

} // namespace trocar
