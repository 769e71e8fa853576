// Connectivity of one surface, built once: its features and which triangle represents each of them, so that a pair of
// features is tested once however many pairs of triangles hold it.
// source   Curtis, Tamstorf, Manocha, "Fast collision detection for deformable models using representative-triangles" (2008).
#pragma once

#include "base/vec.hpp"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace trocar::collision {

using Edge = std::array<Index, 2>; // vertex ids, smaller first

/// Of the surfaces that a search was built over; its contacts name them Thing::body(index).
using SurfaceIndex = std::uint16_t;

struct SurfaceTopology {
    std::vector<Triangle> triangles;                  // [triangle_count] vertex ids
    std::vector<Edge> edges;                          // [edge_count] ascending, each once
    std::vector<std::array<Index, 3>> triangle_edges; // [triangle_count] edge ids of corners 01, 12, 20; kNoIndex for a corner repeated
    std::vector<Index> vertex_owner;                  // [vertex_count] smallest triangle id that holds it, kNoIndex: a loose vertex
    std::vector<Index> edge_owner;                    // [edge_count] smallest triangle id that holds it

    [[nodiscard]] std::size_t vertex_count() const noexcept { return vertex_owner.size(); }
};

/// Takes any triangles whose indices are below vertex_count (a broken contract otherwise): open, non-manifold, duplicate ones
/// too. A triangle that repeats a vertex keeps the edge that is left of it. Loose vertices take no part in collisions.
/// cost   O(n log n)
[[nodiscard]] SurfaceTopology make_topology(std::span<const Triangle> triangles, std::size_t vertex_count);

/// Id of the edge between two vertices; kNoIndex: there is none.
[[nodiscard]] Index find_edge(const SurfaceTopology& topology, Index v0, Index v1) noexcept;

/// What lies around an edge.
struct EdgeFaces {
    std::array<Index, 2> face{kNoIndex, kNoIndex}; // the first two by id
    Index count = 0;                               // of all; 2 on a closed surface whose parts share no edge
};
/// [edge_count]
[[nodiscard]] std::vector<EdgeFaces> faces_of_edges(const SurfaceTopology& topology);

/// One surface over one step: every vertex moves on a straight line at constant speed from t0 to t1. Borrows everything.
struct SurfaceMotion {
    const SurfaceTopology* topology = nullptr;
    std::span<const Vec3> t0, t1; // [vertex_count] m, world
};

} // namespace trocar::collision
