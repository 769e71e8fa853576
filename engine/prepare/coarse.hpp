// The coarse volume mesh of a dense surface: quadric simplification, then TetGen, kept in the cache.
#pragma once

#include "engine/prepare/tetgen.hpp"

#include <cstddef>

namespace trocar::engine {

struct CoarseOptions {
    std::size_t surface_triangles = 800; // of the simplified surface, >= 20
    TetgenOptions tetgen = {};           // tetgen.max_volume 0: derived from the mean triangle, so that tets are about equal;
                                         // tetgen.time_limit is that of each try: one that reaches it is an error
    bool use_cache = true;
};

struct CoarseMesh {
    TetMesh tets;
    std::size_t surface_triangles = 0; // of the simplified surface that was meshed
    bool from_cache = false;
};

/// dense: closed, manifold, outward. A simplified surface that intersects itself, or gives flat tets, is tried again with other
/// triangle counts; the roundest mesh is taken, and at most 4 % of its tets, flat ones, are dropped.
[[nodiscard]] Result<CoarseMesh> make_coarse_mesh(const TriMesh& dense, const CoarseOptions& options);

/// Drops nodes that no tet uses (files from elsewhere have them); returns how many.
std::size_t drop_unused_nodes(TetMesh& mesh);

} // namespace trocar::engine
