// What the clusters of all parts may sweep during a session, and the pairs of clusters whose volumes come near: traversed once, for
// many steps. A volume moves: a box at the session's start and one at its end, and straight lines between; what stays beside each
// other while both move never comes near, though the space that they sweep does.
// This work is based on: Wong (2009), "BVH update with inflation", "partial traversal scheme"; Saltenis, Jensen, Leutenegger, Lopez,
// "Indexing the positions of continuously moving objects" (2000), for boxes whose bounds move. Deviates: volumes belong to clusters
// of triangles, not to triangles (a cluster of one is one).
#pragma once

#include "collision/search/session_drift.hpp"
#include "collision/search/session_parts.hpp"

#include <cstdint>
#include <vector>

namespace trocar::collision {

/// Clusters of all parts in one count: part by part.
struct SessionPair {
    Index a, b; // a <= b
};

/// Where a cluster may be from step `begin` of a session on, up to its last step: what it was then, translated at a constant speed,
/// and inflated.
struct PredictedMotion {
    Vec3 speed = Vec3::Zero(); // m per step
    double inflation = 0.0;    // m
};

class SessionVolumes {
public:
    /// The parts must outlive it.
    void build(std::span<const SurfacePart> parts);

    [[nodiscard]] Index cluster_count() const noexcept { return first_cluster_.empty() ? 0 : first_cluster_.back(); }
    [[nodiscard]] Index first_cluster(std::size_t part) const noexcept { return first_cluster_[part]; }
    [[nodiscard]] Index part_of(Index cluster) const noexcept { return part_of_[cluster]; }

    /// Volume of a cluster.
    /// positions   of the cluster's surface at the beginning of step `begin`
    /// length      steps in the session
    void set_volume(Index cluster, std::span<const Vec3> positions, const PredictedMotion& motion, double begin, double length) noexcept;
    /// Nodes from clusters.
    void refit_nodes() noexcept;

    /// Pairs whose volumes come within reach. marked   [cluster_count] only pairs with a marked cluster; empty: all. Pairs of two
    /// marked clusters come once.
    /// within, between   each surface against itself, against others
    /// most_work         of session_work.hpp: false as soon as that does not suffice; pairs are missing then
    [[nodiscard]] bool traverse(double reach, bool within, bool between, std::span<const std::uint8_t> marked, double most_work,
                                std::vector<SessionPair>& out);
    /// The same for one cluster against all.
    void traverse_alone(Index cluster, double reach, bool within, bool between, std::vector<SessionPair>& out);

    [[nodiscard]] std::uint64_t box_tests() const noexcept { return box_tests_; } // since build; one box against a node's children
    [[nodiscard]] std::size_t memory() const noexcept;

private:
    struct NodePair {
        Index a, b; // nodes, or clusters with DopTree::kLeafBit; ids of their parts
    };
    static constexpr std::size_t kRows = 12; // lo and minus_hi at the start, then at the end
    [[nodiscard]] std::uint32_t near(const float* box, std::size_t stride, std::size_t part, Index node, float reach) noexcept;
    [[nodiscard]] Index node_count(std::size_t part) const noexcept { return first_node_[part + 1] - first_node_[part]; }
    [[nodiscard]] bool is_marked(std::size_t part, Index node) const noexcept;
    [[nodiscard]] const float* cluster_rows(Index cluster) const noexcept { return cluster_rows_.data() + cluster * kRows; }
    [[nodiscard]] const float* node_rows(std::size_t part, Index node) const noexcept {
        return node_rows_.data() + (first_node_[part] + node) * kRows * arity_;
    }
    void mark_nodes(std::span<const std::uint8_t> marked);
    void open(std::size_t p, std::size_t q, NodePair at, float reach, std::vector<SessionPair>& out);
    void push(std::size_t p, std::size_t q, NodePair at, std::vector<SessionPair>& out);

    std::span<const SurfacePart> parts_;
    std::size_t arity_ = 8;
    std::vector<Index> first_cluster_, first_node_; // [part_count + 1]
    std::vector<Index> part_of_;                    // [cluster_count]
    std::vector<float> cluster_rows_;               // [cluster_count][kRows]
    std::vector<float> node_rows_;                  // [node_count][kRows][arity]
    std::vector<std::uint8_t> marked_clusters_, marked_nodes_;
    bool all_marked_ = true;
    std::vector<NodePair> stack_;
    std::uint64_t box_tests_ = 0;
};

} // namespace trocar::collision
