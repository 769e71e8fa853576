// Tetrahedra from a closed surface by TetGen, run as a separate program: it is AGPL, it may crash, it may hang.
// Si 2015, "TetGen, a Delaunay-based quality tetrahedral mesh generator".
#pragma once

#include "base/mesh.hpp"
#include "base/result.hpp"
#include "base/self_intersection.hpp"

#include <string>

namespace trocar::engine {

struct TetgenOptions {
    double max_radius_edge_ratio = 1.414; // [-], quality bound, >= 1.1. Smaller: rounder tets, more of them
    double min_dihedral_degrees = 10.0;   // 0..18. Slivers shrink the stable step
    double max_volume = 0.0;              // m^3 per tet, 0: no bound. A target: TetGen's last smoothing exceeds it in places
    bool keep_surface = true;             // no new points on the surface: coarse surface vertices stay the input's
    double time_limit = 60.0;             // s of wall time, then the process is killed
    std::string program = "tetgen";       // name looked up in PATH, or a path
};

/// Fails with BadMesh (not finite, open, not manifold, inward, self-intersecting: the first bad triangles are named),
/// BadValue (options), MissingTool (names the package), ToolFailed (crash, time limit, unusable output; TetGen's last output).
/// The result is positively oriented, uses every node, and its first vertices are the surface's.
/// timed_out  set to whether the time limit was reached
[[nodiscard]] Result<TetMesh> run_tetgen(const TriMesh& surface, const TetgenOptions& options, bool* timed_out = nullptr);

/// The checks alone: closed, manifold, outward, finite, without self-intersection.
/// max_compared  as of find_self_intersections; a surface whose crossings it does not find out is refused
[[nodiscard]] Result<void> check_meshable_surface(const TriMesh& surface, std::size_t max_compared = kMostCompared);

} // namespace trocar::engine
