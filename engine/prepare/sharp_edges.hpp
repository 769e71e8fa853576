// Edges at which a surface is no curved one in facets.
#pragma once

#include "base/mesh.hpp"
#include "collision/topology.hpp"

#include <vector>

namespace trocar::engine {

/// Convex edges, at rest, whose two faces meet at more than some 20 degrees: ids of the topology's edges, ascending. Edges of another number of
/// faces are none.
/// surface   closed, outward   cost   O(n)
[[nodiscard]] std::vector<Index> find_sharp_edges(const TriMesh& surface, const collision::SurfaceTopology& topology);

} // namespace trocar::engine
