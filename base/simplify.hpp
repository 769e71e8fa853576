// Fewer triangles for the same shape: what coarse meshes and the generator's polygonised surfaces go through.
#pragma once

#include "base/mesh.hpp"
#include "base/result.hpp"

namespace trocar {

struct SimplifyOptions {
    /// Stop before a collapse would cost more than this distance from the planes it has gathered, m (root mean square,
    /// area weighted). Infinity: only the count stops it.
    double max_error = std::numeric_limits<double>::infinity();
    /// Weight of the planes that hold open borders in place, against the surface's own. 0 lets borders shrink.
    double boundary_weight = 10.0;
};

/// Quadric-error edge collapse down to at most target_triangles, or as far as shape and topology allow; ask for the count.
/// A closed manifold surface stays a closed manifold surface of the same genus (link condition); no triangle turns by more
/// than about 78 degrees and none becomes a worse sliver than it was, below an aspect limit. Deterministic: equal costs go by id.
/// Fails on an empty, non-finite or non-manifold surface and on target 0. Unreferenced vertices do not survive.
/// source   Garland & Heckbert 1997. Deviates: area-weighted planes, a small pull to the edge's midpoint where the quadric is flat
[[nodiscard]] Result<TriMesh> simplify(const TriMesh& mesh, std::size_t target_triangles, const SimplifyOptions& options = {});

} // namespace trocar
