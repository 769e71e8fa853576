// A sphere tree from elsewhere made to hold a surface: each part of the surface is given to a leaf that holds it, or to the nearest one,
// and spheres grow by what they lack. After that nothing of the surface is outside the tree, whatever the file left out.
//
// This work is based on: Bradshaw & O'Sullivan 2004, "Adaptive medial-axis approximation for sphere-tree construction", whose trees leave
// 1 to 2 % of the surface uncovered (quoted).
#pragma once

#include "base/mesh.hpp"
#include "spheretree/sphere_tree.hpp"

namespace trocar::spheretree {

/// What the tree lacked as it came, and what was done about it. Lengths in the surface's unit.
struct Coverage {
    double uncovered = 0.0;        // share of the area outside all leaves, 0..1; parts shorter than AdoptOptions::finest count as wholes
    std::size_t triangles = 0;     // of which some lies outside all leaves
    double farthest = 0.0;         // that a corner of such a part lies outside the nearest leaf
    double unreachable = 0.0;      // share of the area that a leaf holds and some sphere above it does not, 0..1
    std::size_t grown_leaves = 0;  // leaves that were enlarged
    double leaf_growth = 0.0;      // of the radius of one of them, at most
    std::size_t grown_inner = 0;   // spheres above leaves that were enlarged, until they hold what lies beneath
    double inner_growth = 0.0;
    std::size_t idle_leaves = 0;   // leaves to which no part was given: left out
    [[nodiscard]] bool is_whole() const noexcept { return triangles == 0 && grown_inner == 0; }
};

struct AdoptOptions {
    /// Parts of triangles are halved until a leaf and all above it hold them, or their longest edge is below this share of the surface's
    /// longest side (a hundredth after 400,000 cuts: a tree with that many gaps grows by more).
    double finest = 1e-4;
};

struct AdoptedTree {
    SphereTree tree; // items: triangle ids; a triangle may be beneath several leaves, each of which holds a part of it
    Coverage coverage;
};

/// Longest side of the box around all leaves; 0 without any.
[[nodiscard]] double leaves_extent(const SphereTree& tree) noexcept;

/// Farthest that a vertex of the surface lies outside the nearest leaf; negative or zero: all are inside.
[[nodiscard]] double farthest_outside(const SphereTree& tree, const TriMesh& surface);

/// Of several leaves that hold a part the one is taken whose ancestors lack least, then the one that holds it deepest, then the first: the same
/// input gives the same bits. Every sphere holds all parts beneath it afterwards.
/// foreign  with at least one leaf; items are not read      surface  finite, with at least one triangle; both in one frame and unit
/// cost     O(parts log(leaves))
[[nodiscard]] AdoptedTree adopt_tree(const SphereTree& foreign, const TriMesh& surface, const AdoptOptions& options = {});

} // namespace trocar::spheretree
