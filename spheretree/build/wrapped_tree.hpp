// Wrapped sphere trees of surfaces, built off line: on every level the spheres together hold the whole surface, and each
// sphere holds all of the surface that its children hold, so that every surface point is reached by descending through
// spheres that hold it. Both are properties of how the surface is shared out, not of samples.
//
// This work is based on: Bradshaw & O'Sullivan 2004, "Adaptive medial-axis approximation for sphere-tree construction";
// baselines: Hubbard 1996, "Approximating polyhedra with spheres for time-critical collision detection" (medial spheres
// merged pair by pair), and the octree of both papers. Deviates: spheres are grown until they hold convex pieces of triangles,
// where the papers hold sample points and leave 1 to 2 % of the surface uncovered.
#pragma once

#include "base/result.hpp"
#include "base/self_intersection.hpp"
#include "spheretree/build/piece.hpp"
#include "spheretree/build/wrapped_options.hpp"
#include "spheretree/sphere_tree.hpp"

#include <functional>
#include <string>
#include <vector>

namespace trocar::spheretree {

/// Of a coordinate's size, in whatever unit. Volumes and their squares are taken of coordinates: beyond this they would overflow.
inline constexpr double kLargestCoordinate = 1e30;

/// Built once, then only read. All leaves lie on the last level; a part of the surface that needs no refining has a chain of
/// single children. tree.items are the triangles of `pieces`, in the same order.
struct WrappedTree {
    SphereTree tree;
    PieceSet set{{}};
    std::vector<Piece> pieces; // [item_count] beneath leaf s: pieces[item_begin[s] .. item_end[s])
    /// The surface is so long and thin that it would have been cut into too many pieces: it was cut less, and spheres grew instead.
    bool coarser = false;
};

/// Fails (BadMesh, first bad triangles named, and the builder or the repair that would accept it) on an open, self-intersecting,
/// inconsistently oriented or inverted surface where the builder needs a closed one; (BadMesh) on an empty or non-finite
/// surface, or one beyond kLargestCoordinate; (BadValue) on options out of range. Non-manifold edges and several components are fine.
/// Coordinates may be in any unit. The same input gives the same bits.
[[nodiscard]] Result<WrappedTree> build_wrapped_tree(const TriMesh& surface, const WrappedOptions& options = {},
                                                      const std::function<void(double share)>& progress = {});

/// What WrappedTree::coarser means for a surface, with its numbers.
[[nodiscard]] std::string describe_coarser(const TriMesh& surface);

/// What build_wrapped_tree asks of a surface.
/// max_compared  as of find_self_intersections; a surface whose crossings it does not find out is refused
[[nodiscard]] Result<void> check_surface_for(const TriMesh& surface, Builder builder, std::size_t max_compared = kMostCompared);

} // namespace trocar::spheretree
