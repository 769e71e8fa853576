// Marching tetrahedra over a cubic grid, each cube cut into Kuhn's six: the cut of a tetrahedron is one disc, so the
// surface is a closed manifold whatever the field (Payne & Toga 1990; Bloomenthal 1994). Shapes are poor: see remesh.hpp.
#pragma once

#include "assets/anatomy/field.hpp"
#include "base/mesh.hpp"

namespace trocar::anatomy {

/// Surface of the field inside `box`, oriented from negative to positive values. The zero set must not touch the box's sides.
/// cell       m, edge of the grid's cubes: features thinner than this get lost
/// steepness  most the field changes per metre; blocks of cells that cannot hold the surface are skipped
[[nodiscard]] TriMesh polygonise(const Field& field, const Box3& box, double cell, double steepness);

} // namespace trocar::anatomy
