// The broad phase of a search between two surfaces: from the trees' roots to the pairs of clusters whose bounds come near.
#pragma once

#include "collision/search/surface_pair.hpp"

#include <vector>

namespace trocar::collision {

/// Pairs of clusters that come near, some at a time.
class ClusterTraversal {
public:
    ClusterTraversal();
    void start(const SurfacePair& pair);
    /// Appends pairs until at least `wanted` are new or there are no more; false: there are no more.
    [[nodiscard]] bool advance(const SurfacePair& pair, std::size_t wanted, std::vector<ClusterPair>& out);
    /// Most that one call appends beyond what was wanted.
    static constexpr std::size_t kMostExtra = 64;
    [[nodiscard]] std::uint64_t box_tests() const noexcept { return box_tests_; } // since the start

private:
    void push(const SurfacePair& pair, Index a, Index b, std::vector<ClusterPair>& out);
    void open_node_and_leaf(const SurfacePair& pair, ClusterPair at, std::vector<ClusterPair>& out);
    void open_nodes(const SurfacePair& pair, ClusterPair at, std::vector<ClusterPair>& out);

    std::vector<ClusterPair> stack_; // nodes, or clusters with DopTree::kLeafBit
    std::uint64_t box_tests_ = 0;
};

} // namespace trocar::collision
