// The hierarchy of the exact whole-step search: wide nodes of k-DOPs over clusters of triangles; each cluster owns blocks of features
// (faces, edges, vertices) stored lane by lane, so that one feature is tested against sixteen at a time.
// This work is based on: Fuenfzig, Fellner, "Easy realignment of k-DOP bounding volumes" (2003) and Mezger, Kimmerle, Etzmuss,
// "Hierarchical techniques in collision detection for cloth animation" (2003) for the arity; Wald, "On fast construction of
// SAH-based bounding volume hierarchies" (2007) for the binned builder. Deviates: leaves are clusters (down to one triangle on
// request), since a block of 16 lanes costs one test whether it holds one feature or sixteen.
//
// Cost of one step, n triangles (about n/2 vertices, 3n/2 edges, n/24 clusters), p pairs of clusters that come near, c candidates:
//   refit      O(n): every vertex, cluster and node
//   traverse   O(p log n): one test of a box against a node's children at a time
//   collect    O(p): blocks of 16 against single features; with it, where clusters are met first, their blocks and fine bounds
//   decide     O(c)
// p and c follow the contact, not n; a surface against itself has p and c of order n from neighbours alone.
// Memory, boxes of 6 and clusters of 32: about 195 bytes a triangle (blocks are not full: one of 16 lanes takes 640 bytes; `fine`
// adds about 45); DopTree::memory() counts, and `trocar bench contacts` prints it.
#pragma once

#include "collision/bvh/fine_bounds.hpp"
#include "collision/bvh/tree_options.hpp"
#include "collision/topology.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace trocar::collision {

class DopTree {
public:
    static constexpr std::size_t kLanes = 16; // features in a block
    static constexpr std::size_t kMaxClusterSize = 64;

    /// Sixteen features side by side. bounds_ holds 2 slabs rows of kLanes floats per block: all lo, then all minus_hi.
    struct BlockRange {
        Index begin = 0, end = 0; // blocks
        Index count = 0;          // features; the last block may have empty lanes, which overlap nothing
    };
    struct Cluster {
        BlockRange faces, edges, vertices;        // edges and vertices: those it owns
        Index touched_begin = 0, touched_end = 0; // all vertices of its faces
    };
    /// Child of a node: another node, or a cluster.
    static constexpr Index kLeafBit = 0x80000000u;
    static constexpr Index kNoChild = kNoIndex;

    /// The topology must outlive the tree. Positions give the shape of the tree only; refit before any search.
    /// cost   O(n log n), allocates, as nothing after it does
    void build(const SurfaceTopology& topology, std::span<const Vec3> positions, const TreeOptions& options);

    /// Bounds of a new step, in three parts of which the first two can run on several threads: vertices, then clusters, then nodes.
    /// Blocks of features are refitted cluster by cluster, on demand: where a surface meets another one in places,
    /// most are never needed.
    /// cost   O(n), no allocation
    void refit(const SurfaceMotion& motion);
    void refit_vertices(const SurfaceMotion& motion, Index begin, Index end) noexcept;
    void refit_clusters(Index begin, Index end) noexcept;
    void refit_nodes() noexcept;
    /// Goes on to the next motion, which begins where the last one that the tree was refitted to, or followed, has ended, or where that one
    /// began. Bounds are brought to it where a search asks for them (open, make_fresh); elsewhere they stay, and hold the surface within
    /// the way that it has come since. The positions must stay where they are until the next motion.
    /// way    m, no vertex is farther from its start than that in any part of the motion
    /// cost   O(1); all that is asked for of it O(what is near), no allocation
    void follow(const SurfaceMotion& motion, double way) noexcept;
    /// Bounds of a node's children: to be called before child_bounds, as make_fresh before anything of a cluster.
    void open(Index node) noexcept {
        if (node_at_[node] != travelled_) bring_node(node);
    }
    void make_fresh(Index cluster) noexcept {
        if (cluster_at_[cluster] != travelled_) bring_cluster(cluster);
    }
    /// Refitted on demand: the bounds of a cluster's features; where options().fine is set, the fine bounds of the
    /// cluster, and those of its vertices. Different clusters on different threads, but for the vertices, which clusters share.
    [[nodiscard]] bool blocks_are_fresh(Index cluster) const noexcept { return (fresh_[cluster] & kBlocks) != 0; }
    [[nodiscard]] bool fine_is_fresh(Index cluster) const noexcept { return (fresh_[cluster] & kFine) != 0; }
    [[nodiscard]] bool fine_vertices_are_fresh(Index cluster) const noexcept { return (fresh_[cluster] & kFineVertices) != 0; }
    void refit_blocks(Index cluster) noexcept;
    void refit_fine(Index cluster, const SurfaceMotion& motion) noexcept;
    void refit_fine_vertices(Index cluster, const SurfaceMotion& motion) noexcept;

    [[nodiscard]] bool empty() const noexcept { return clusters_.empty(); }
    [[nodiscard]] const SurfaceTopology& topology() const noexcept { return *topology_; }
    [[nodiscard]] const TreeOptions& options() const noexcept { return options_; }
    [[nodiscard]] std::size_t slabs() const noexcept { return options_.dop / 2; }
    [[nodiscard]] std::span<const Cluster> clusters() const noexcept { return clusters_; }
    /// All vertices of its faces, ascending.
    [[nodiscard]] std::span<const Index> touched(Index cluster) const noexcept {
        return std::span(touched_).subspan(clusters_[cluster].touched_begin,
                                           clusters_[cluster].touched_end - clusters_[cluster].touched_begin);
    }
    /// Root: node 0, unless the tree is one cluster.
    [[nodiscard]] Index root() const noexcept { return children_.empty() ? kLeafBit : 0; }
    [[nodiscard]] std::span<const Index> children(Index node) const noexcept {
        return {children_.data() + node * options_.arity, options_.arity};
    }
    /// Rows of `arity` floats: all slabs' lo, then all minus_hi.
    [[nodiscard]] const float* child_bounds(Index node) const noexcept { return node_bounds_.data() + node * 2 * slabs() * options_.arity; }
    /// 2 slabs floats: lo, then minus_hi.
    [[nodiscard]] const float* cluster_bounds(Index cluster) const noexcept { return cluster_bounds_.data() + cluster * 2 * slabs(); }
    [[nodiscard]] const float* block_bounds(Index block) const noexcept { return bounds_.data() + block * 2 * slabs() * kLanes; }
    [[nodiscard]] const Index* block_ids(Index block) const noexcept { return ids_.data() + block * kLanes; }
    /// Vertex ids of the block's features, three rows of kLanes; a row that a feature does not have repeats the first.
    [[nodiscard]] const Index* block_corners(Index block) const noexcept { return corners_.data() + block * 3 * kLanes; }

    /// Where options().fine is set: of a cluster, of a vertex.
    [[nodiscard]] const FineBounds& fine_cluster(Index cluster) const noexcept { return fine_clusters_[cluster]; }
    [[nodiscard]] const FineBounds& fine_vertex(Index vertex) const noexcept { return fine_vertices_[vertex]; }

    /// Bytes of everything that the tree holds.
    [[nodiscard]] std::size_t memory() const noexcept;

private:
    static constexpr std::uint8_t kBlocks = 1, kFine = 2, kFineVertices = 4;
    void bring_node(Index node) noexcept;
    void bring_cluster(Index cluster) noexcept;
    struct BuildState;
    Index build_node(BuildState& state, std::span<Index> order);
    Index add_cluster(BuildState& state, std::span<const Index> triangles);
    BlockRange add_blocks(std::span<const Index> ids, int corners);
    template <std::size_t Slabs, std::size_t Corners>
    void refit_lanes(const BlockRange& range) noexcept;
    template <std::size_t Slabs>
    void refit_blocks_of(const Cluster& cluster) noexcept;
    template <std::size_t Slabs>
    void refit_clusters_of(Index begin, Index end) noexcept;
    void own_features(BuildState& state, std::span<const Index> triangles, std::vector<Index>& edges, std::vector<Index>& vertices) const;

    const SurfaceTopology* topology_ = nullptr;
    TreeOptions options_;
    std::vector<Index> children_;    // [node_count][arity], parents before children
    std::vector<float> node_bounds_; // [node_count][2 slabs][arity]
    std::vector<Cluster> clusters_;
    std::vector<Index> touched_;                // vertex ids, cluster by cluster
    std::vector<float> cluster_bounds_;         // [cluster_count][2 slabs]
    std::vector<std::uint8_t> fresh_;           // [cluster_count] what belongs to the last refit
    std::vector<float> bounds_;                 // [block_count][2 slabs][kLanes]
    std::vector<Index> ids_;                    // [block_count][kLanes] feature ids, kNoIndex in empty lanes
    std::vector<Index> corners_;                // [block_count][3][kLanes]
    std::vector<float> vertex_bounds_;          // [vertex_count][2 slabs]
    std::vector<FineBounds> fine_vertices_, fine_clusters_;
    SurfaceMotion motion_;                   // that is followed
    double travelled_ = 0.0;                 // m, that a vertex has come at most, this motion included
    std::vector<double> node_at_, cluster_at_; // m, travelled_ when their bounds were brought to the motion of that time
};

} // namespace trocar::collision
