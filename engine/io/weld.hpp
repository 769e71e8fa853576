// Exact weld: vertices with equal coordinates become one. Nothing is moved, no tolerance is involved.
#pragma once

#include "base/mesh.hpp"

#include <cstddef>

namespace trocar::engine {

/// Joins vertices with equal coordinates (-0 equals 0) and keeps the order of first appearance. Triangles stay, even
/// those that lose a corner. Returns how many vertices went.
/// cost      O(vertex_count), a hash table whose order no result depends on; O(vertex_count log) of positions made to collide in it
std::size_t weld_equal_vertices(TriMesh& mesh);

/// Drops nodes that no tetrahedron uses; the others keep their order. Returns how many went.
/// kept  of every node before: its place now, kNoIndex where it was dropped; may be null
std::size_t drop_unreferenced_nodes(TetMesh& mesh, std::vector<Index>* kept = nullptr);

} // namespace trocar::engine
