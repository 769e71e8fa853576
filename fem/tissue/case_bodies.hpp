// What the classical cases (classical_cases.hpp, wall_cases.hpp) make their bodies and loads of.
#pragma once

#include "base/mesh.hpp"
#include "fem/tissue/tissue.hpp"

#include <vector>

namespace trocar::fem {

using Field = std::vector<Vec3>; // [node_count]

/// Of stable neo-Hookean tissue. sheet: of a wall in prisms, nodes a sheet
[[nodiscard]] TissueModel make_body(const TetMesh& mesh, double young, double poisson_ratio, TetElements elements, const std::vector<Index>& pinned = {},
                                    double density = 1000.0, Index sheet = 0);

/// Whose coordinate along an axis is this, to 1e-9.
[[nodiscard]] std::vector<Index> nodes_across(const TetMesh& mesh, int axis, double value);

/// Of an inner pressure 1 on the nodes of a surface, outwards.
[[nodiscard]] Field press_out(const TetMesh& mesh, const TriMesh& inner);

} // namespace trocar::fem
