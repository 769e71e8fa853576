// Edges at which a surface is no curved one in facets.
#pragma once

#include "base/mesh.hpp"

#include <array>
#include <vector>

namespace trocar {

/// Cosine between two faces, beyond which their edge is sharp: some 20 degrees.
inline constexpr double kSharpEdge = 0.94;

/// Convex edges whose two faces meet at more than the angle of this cosine: vertex pairs, lower id first, ascending. Edges of another
/// number of faces are none, nor are edges of faces without area.
/// surface   outward   cost   O(n log n)
[[nodiscard]] std::vector<std::array<Index, 2>> find_sharp_edges(const TriMesh& surface, double cosine = kSharpEdge);

} // namespace trocar
