// Surfaces cut into their connected pieces, each with a tree of its own: things that slide along each other, though they come as one
// mesh, then never share a cluster, and the features of a cluster move almost alike. Skipping frames depends on that.
#pragma once

#include "base/contact.hpp"
#include "collision/bvh/dop_tree.hpp"

#include <span>
#include <vector>

namespace trocar::collision {

/// One connected piece of a surface, or all its small ones together. Ids inside are its own.
struct SurfacePart {
    SurfaceIndex surface = 0;
    SurfaceTopology topology;
    std::vector<Index> vertex_of, edge_of, face_of; // id here -> id in the surface, ascending
    DopTree tree;                                   // its shape and features alone are used, not its bounds
    std::vector<Index> touched;                     // vertices of the surface, cluster by cluster, ascending
    std::vector<Index> touched_begin;               // [cluster_count + 1]
    double edge_length = 0.0;                       // m, mean when the tree was built

    [[nodiscard]] std::span<const Index> touched_by(Index cluster) const noexcept {
        return std::span(touched).subspan(touched_begin[cluster], touched_begin[cluster + 1] - touched_begin[cluster]);
    }
    /// Bytes of everything that it holds.
    [[nodiscard]] std::size_t memory() const noexcept;
};

/// A cluster of a part's tree.
struct ClusterPlace {
    std::size_t part;
    Index cluster;
};

/// Appends the pieces of a surface; those below a 32nd of it share one part. Their trees are still empty.
/// cost   O(n log n), allocates
void add_parts(SurfaceIndex surface, const SurfaceTopology& topology, std::span<const Vec3> positions, std::vector<SurfacePart>& parts);

/// Builds the trees, once the parts stay where they are: a tree points to the topology beside it.
/// positions   [surface][vertex] m
void build_trees(std::span<SurfacePart> parts, std::span<const std::span<const Vec3>> positions, const TreeOptions& options);

} // namespace trocar::collision
