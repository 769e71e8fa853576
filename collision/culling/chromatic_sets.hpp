// Chromatic decomposition: the triangles of a mesh in sets none of whose members touch, so that a set can be drawn as a whole and
// every triangle has at most one neighbour to leave out of it.
// This work is based on: Govindaraju, Knott, Jain, Kabul, Tamstorf, Gayle, Lin, Manocha, "Interactive collision detection between
// deformable models using chromatic decomposition" (2005), section 4; Brelaz, "New methods to color the vertices of a graph" (1979).
#pragma once

#include "base/vec.hpp"

#include <optional>
#include <span>
#include <vector>

namespace trocar::collision {

/// Triangles are adjacent where they share a vertex. Two guarantees, whatever the mesh:
/// 1. no two triangles of one set are adjacent;
/// 2. a triangle is adjacent to at most one triangle of any set.
struct ChromaticSets {
    std::vector<Index> set_of;  // [triangle_count]
    std::vector<Index> begin;   // [count + 1] into members
    std::vector<Index> members; // [triangle_count] set by set, ids ascending
    bool from_grid = false;     // by the linear-time colouring of a quad grid
    Index hub_triangles = 0;    // at a vertex of very high valence: each in a set of its own

    [[nodiscard]] Index count() const noexcept { return begin.empty() ? 0 : static_cast<Index>(begin.size() - 1); }
    [[nodiscard]] std::span<const Index> set(Index id) const noexcept {
        return std::span(members).subspan(begin[id], begin[id + 1] - begin[id]);
    }
};

/// The grid's colouring where find_quad_grid finds one, DSATUR on the extended dual graph otherwise.
/// cost   O(E log V), E edges of the extended dual graph: about 20 per triangle of an ordinary mesh; bounded for hostile ones
[[nodiscard]] ChromaticSets make_chromatic_sets(std::span<const Triangle> triangles, std::size_t vertex_count);
/// DSATUR, whatever the mesh looks like. Deterministic: most colours around, then most neighbours, then lowest id.
[[nodiscard]] ChromaticSets make_sets_by_dsatur(std::span<const Triangle> triangles, std::size_t vertex_count);

/// Vertices row by row, each quad two consecutive triangles: how cloth is usually written.
struct QuadGrid {
    Index row_length; // vertices in a row
};
/// The triangles may be any part of the grid, in any order of quads, cut along either diagonal; each quad at most once.
/// cost   O(n)
[[nodiscard]] std::optional<QuadGrid> find_quad_grid(std::span<const Triangle> triangles, std::size_t vertex_count);
/// Nine sets of quads by their place modulo three, eighteen of triangles: both triangles of a quad in sets of their own.
/// cost   O(n)
/// source   Eppstein, Bern, Hutchings, "Algorithms for coloring quadtrees" (2002), extended to neighbours of neighbours as in
///          Govindaraju et al. 2005
[[nodiscard]] ChromaticSets make_sets_of_grid(std::span<const Triangle> triangles, const QuadGrid& grid);

/// Triangles around each vertex, each named once by a vertex: what tells neighbours without listing all pairs of a high fan.
class TriangleStars {
public:
    TriangleStars() = default;
    TriangleStars(std::span<const Triangle> triangles, std::size_t vertex_count);
    [[nodiscard]] std::span<const Index> of(Index vertex) const noexcept {
        return std::span(triangles_).subspan(begin_[vertex], begin_[vertex + 1] - begin_[vertex]);
    }

private:
    std::vector<Index> begin_, triangles_;
};

[[nodiscard]] inline bool are_adjacent(const Triangle& a, const Triangle& b) noexcept {
    for (const Index v : a)
        if (v == b[0] || v == b[1] || v == b[2]) return true;
    return false;
}

/// Two adjacent triangles of two sets, or one that has no neighbour in the other set and so a slot of its own.
struct SetSlot {
    Index of_i = kNoIndex, of_j = kNoIndex;
};
/// One order for both sets, as the two passes need it. A set with itself pairs every triangle with itself.
/// cost   O(members times valence)
/// source   Govindaraju et al. 2005, algorithm 4.1
[[nodiscard]] std::vector<SetSlot> pair_sets(const ChromaticSets& sets, std::span<const Triangle> triangles, const TriangleStars& stars,
                                             Index i, Index j);

/// Violations of the two guarantees: for tests, and for callers with sets of their own.
struct SetViolations {
    std::size_t adjacent_in_set = 0;   // pairs (triangle, vertex) that a second triangle of its set touches
    std::size_t second_neighbours = 0; // triangles with more than one neighbour in some set, counted once per surplus neighbour
};
[[nodiscard]] SetViolations check_sets(const ChromaticSets& sets, std::span<const Triangle> triangles, const TriangleStars& stars);

} // namespace trocar::collision
