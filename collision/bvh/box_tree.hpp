// Tree of swept boxes over one surface. Its leaves are clusters of neighbouring triangles, each with the vertices and edges
// it owns: refitting touches a vertex about twice instead of six times, and the features of two overlapping clusters
// are compared only on demand.
#pragma once

#include "collision/swept_box.hpp"
#include "collision/topology.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace trocar::collision {

class BoxTree {
public:
    /// Triangles in a cluster, at most. More makes refitting cheaper and comparing two clusters dearer.
    static constexpr std::size_t kClusterSize = 8;
    /// Edges a cluster can own, at most; no cluster touches more vertices.
    static constexpr std::size_t kClusterFeatures = 3 * kClusterSize;

    struct Node {
        SweptBox box;             // holds everything beneath at every time of the step
        Index left = kNoIndex;    // children left and left + 1; kNoIndex for a leaf
        Index cluster = kNoIndex; // of a leaf
    };
    struct Range {
        Index begin = 0, end = 0;
        [[nodiscard]] Index size() const noexcept { return end - begin; }
    };
    struct Cluster {
        Range triangles; // into triangle_ids()
        Range edges;     // into edge_ids(), those it owns
        Range vertices;  // into vertex_ids(), those it owns
        Range touched;   // into touched_ids(), all vertices of its triangles
        Index node = kNoIndex;
    };

    /// Split by the longest axis of the triangles' centres at rest, ties by id. The topology must outlive the tree.
    /// cost   O(n log^2 n); allocates, as nothing after it does
    void build(const SurfaceTopology& topology, std::span<const Vec3> positions);

    /// Boxes of a new step. A vertex that is not finite makes its boxes everything, never nothing.
    /// cost   O(n), no allocation
    void refit(const SurfaceMotion& motion);
    /// The same when only these vertices move: all others must stand where the last refit's step ended.
    /// cost   O(moved + ancestors) and one byte read per node, no allocation
    void refit_moved(const SurfaceMotion& motion, std::span<const Index> moved);

    [[nodiscard]] bool empty() const noexcept { return nodes_.empty(); }
    [[nodiscard]] const SurfaceTopology& topology() const noexcept { return *topology_; }
    [[nodiscard]] std::span<const Node> nodes() const noexcept { return nodes_; } // root first, parents before children
    [[nodiscard]] std::span<const Cluster> clusters() const noexcept { return clusters_; }
    [[nodiscard]] std::span<const Index> triangle_ids() const noexcept { return triangle_ids_; }
    [[nodiscard]] std::span<const Index> edge_ids() const noexcept { return edge_ids_; }
    [[nodiscard]] std::span<const Index> vertex_ids() const noexcept { return vertex_ids_; }

    /// Boxes of one cluster's features, in the order of its three ranges. Made at the first call after a refit.
    struct FeatureBoxes {
        std::span<const SweptBox> triangles, edges, vertices;
    };
    [[nodiscard]] FeatureBoxes feature_boxes(Index cluster);

private:
    void split(Index node, std::span<Index> order, std::span<const Vec3> centres);
    void add_cluster(Index node, std::span<const Index> triangles);
    void gather_features();
    void refit_node(Node& node) const;
    void make_feature_boxes(Index cluster);

    const SurfaceTopology* topology_ = nullptr;
    std::vector<Node> nodes_;
    std::vector<Index> parents_; // [node_count]
    std::vector<Cluster> clusters_;
    std::vector<Index> triangle_ids_, edge_ids_, vertex_ids_, touched_ids_;
    std::vector<Index> vertex_cluster_begin_, vertex_clusters_;        // clusters that hold a vertex, by vertex
    std::vector<SweptBox> moving_;                                     // [vertex_count]
    std::vector<SweptBox> triangle_boxes_, edge_boxes_, vertex_boxes_; // beside the ids
    std::vector<std::uint8_t> boxes_made_;                             // [cluster_count]
    std::vector<std::uint8_t> dirty_;                                  // [node_count] scratch of refit_moved
};

} // namespace trocar::collision
