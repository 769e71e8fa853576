// Edges at which a surface is no curved one in facets.
#pragma once

#include "base/mesh.hpp"
#include "collision/topology.hpp"

#include <vector>

namespace trocar::engine {

/// Convex edges, at rest, whose two faces meet at more than some 20 degrees: ids of the topology's edges, ascending. Of a closed surface,
/// outward.
/// Edges of more than two faces are none. cost   O(n)
[[nodiscard]] std::vector<Index> find_sharp_edges(const TriMesh& surface, const collision::SurfaceTopology& topology);

/// Places that lists of contact are reserved for: a surface's vertices, and some crossings of each sharp edge.
[[nodiscard]] std::size_t reserved_places(const TriMesh& surface, const collision::SurfaceTopology& topology);

} // namespace trocar::engine
