// Covering tree of any surface: on every level the spheres together hold the whole surface. A triangle is the convex hull of
// its corners, so a sphere that holds the corners holds the triangle, also while the corners move on straight lines: the
// bound stays true under any deformation, at no more than the cost of reading the corners.
//
// This work is based on: Bradshaw & O'Sullivan 2004, "Adaptive medial-axis approximation for sphere-tree construction"
// (wrapped hierarchy), and James & Pai 2004, "BD-Tree" (bounds that follow the deformation).
// Deviates: spheres bound median-split groups of triangles instead of medial-axis candidates.
#pragma once

#include "base/mesh.hpp"
#include "spheretree/sphere_tree.hpp"

namespace trocar::spheretree {

struct CoveringOptions {
    unsigned branching = 8;      // 2, 4 or 8 children at most
    unsigned leaf_triangles = 6; // triangles of a leaf at most; fewer: tighter leaves, more of them
};

struct CoveringTree {
    SphereTree tree;                 // items: triangle ids, each beneath exactly one leaf
    std::vector<Index> vertex_begin; // [sphere_count + 1] corners of a leaf's triangles, empty at inner spheres
    std::vector<Index> vertices;     // vertex ids, each once per leaf
};

/// Any surface, closed or not; triangles with corners that are not finite make their spheres empty. An empty mesh gives an
/// empty tree.
[[nodiscard]] CoveringTree build_covering_tree(const TriMesh& mesh, const CoveringOptions& options = {});

/// Spheres that hold their triangles over the whole step: at t0, at t1 and on the straight lines between.
/// vertices_t0/_t1  [vertex_count] m      spheres  [sphere_count] out, resized
/// cost      O(triangles), no allocation after the first call
void update_covering_spheres(const CoveringTree& covering, std::span<const Vec3> vertices_t0, std::span<const Vec3> vertices_t1,
                             std::vector<Sphere>& spheres);

} // namespace trocar::spheretree
