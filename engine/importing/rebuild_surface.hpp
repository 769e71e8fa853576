// A surface that no chain of repairs mends, made anew from what it encloses: the winding number says what is inside, a grid is cut by
// the distance to the old triangles. Crossings, double parts and overlaps become one skin; detail below the grid's cells is lost.
#pragma once

#include "base/mesh.hpp"
#include "base/result.hpp"

#include <string>

namespace trocar::engine {

struct RebuiltSurface {
    TriMesh surface; // m; closed, manifold, outward
    std::string told; // what was done, with the cells' size and the largest distance to the old surface
};

/// raw    m, any triangles with finite corners; holes are closed first where they can be
/// fails  BadMesh: it encloses nothing, or nothing that is wider than a cell
[[nodiscard]] Result<RebuiltSurface> rebuild_surface(const TriMesh& raw);

/// Largest distance from the vertices and the middles of the triangles of one surface to another.
[[nodiscard]] double largest_distance(const TriMesh& from, const TriMesh& to);

} // namespace trocar::engine
