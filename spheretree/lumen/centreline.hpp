// The middle of a lumen as a tree: from one place into every branch and dead end.
//
// This work is based on:
//   Sato, Bitter, Bender, Kaufman, Nakajima 2000, "TEASAR: tree-structure extraction algorithm for accurate and robust skeletons"
//   (the farthest place not yet covered begins the next branch; what lies near a branch counts as covered).
// Deviates: paths go from inscribed sphere to overlapping sphere, and are the route planner's own (find_lumen_path).
#pragma once

#include "base/result.hpp"
#include "spheretree/lumen/lumen_tree.hpp"

namespace trocar::spheretree {

/// Point 0 is the root; every other one comes after its parent.
struct CentrelineTree {
    std::vector<Vec3> points;   // [point_count] m, rest pose
    std::vector<double> radii;  // [point_count] m, of the lumen: of the largest inscribed sphere in whose middle the point lies
    std::vector<Index> parents; // [point_count] kNoIndex: the root

    [[nodiscard]] std::size_t point_count() const noexcept { return points.size(); }
};

struct CentrelineOptions {
    double spacing = 1e-3;  // m, of the points, about
    double seen = 1.6;      // of the radius at a point: what lies nearer to it is no branch. A sac deeper than that counts as one
    double join = 0.5;      // of the radius: a branch begins where it has left the tree by that much
    unsigned smoothing = 8; // rounds, as PathOptions::smoothing
};

/// root      m, inside the lumen or at most a ball's radius outside of it
/// fails     BadValue: the root lies outside. Parts of the lumen that cannot be reached from it are left out
/// cost      offline: a search over all balls for every branch
[[nodiscard]] Result<CentrelineTree> find_centreline_tree(const LumenTree& lumen, const Vec3& root, const CentrelineOptions& options = {});

} // namespace trocar::spheretree
