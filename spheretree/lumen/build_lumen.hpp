// Builds the tree of a lumen (lumen_tree.hpp) from its wall.
//
// This work is based on:
//   Ma, Bae, Choi 2012, "3D medial axis point approximation using nearest neighbors and the normal field" (shrinking balls).
//   Peters & Ledoux 2016, "Robust approximation of the medial axis transform of LiDAR point clouds" (separation angle).
// Deviates: balls shrink against the triangles themselves, not against samples, and are then grown towards the medial axis;
// every ball's radius is the exact distance of its centre to the wall. A greedy cover picks the few that matter.
#pragma once

#include "base/mesh.hpp"
#include "base/result.hpp"
#include "spheretree/lumen/lumen_tree.hpp"

namespace trocar::spheretree {

struct LumenOptions {
    double relative_error = 0.04;     // of the local radius: how deep a wall sample may lie outside the union of the balls
    double error_floor = 2e-5;        // m; finer detail of the wall than this is not followed
    double corner_ratio = 0.25;       // of the local radius: corners that only smaller balls reach are left to the exact stage
    double min_radius = 1e-4;         // m; narrower lumen is treated as closed. Half the instrument's radius is enough
    double link_reach = 0.15;         // of a ball's radius: wall triangles within that much beyond it move it
    unsigned branching = 8;           // 2, 4 or 8 children at most
    std::size_t max_samples = 60'000; // of the wall, about; a larger or finer lumen is sampled more sparsely
};

/// What was reached, for the build's report.
struct LumenReport {
    std::size_t samples = 0, candidates = 0, balls = 0;
    std::size_t components = 0;      // of the union of the balls; 1: every part can be reached from every other
    double worst_relative_error = 0; // over the samples: distance to the union / local radius
    double mean_relative_error = 0;
};

/// closed_lumen  closed, oriented outwards (free space inside), without self-intersections: a wall inside the lumen is a wall
/// fails     BadMesh: open, inward, empty, or narrower than min_radius everywhere
/// cost      seconds for 60K triangles; offline
[[nodiscard]] Result<LumenTree> build_lumen_tree(const TriMesh& closed_lumen, const LumenOptions& options = {},
                                                 LumenReport* report = nullptr);

} // namespace trocar::spheretree
