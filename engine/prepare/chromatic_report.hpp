// The report of `prepare` on a mesh's chromatic decomposition.
#pragma once

#include "collision/culling/chromatic_sets.hpp"

namespace trocar::engine {

struct ChromaticReport {
    Index colours = 0;
    double seconds = 0.0;    // wall, of the decomposition alone
    bool from_grid = false;  // by the linear-time colouring of quad grids
    Index hub_triangles = 0; // at vertices of very high valence, each in a set of its own
};

/// Decomposes the mesh and times it.
/// sets   written if not null
[[nodiscard]] ChromaticReport report_chromatic(std::span<const Triangle> triangles, std::size_t vertex_count,
                                               collision::ChromaticSets* sets = nullptr);

} // namespace trocar::engine
