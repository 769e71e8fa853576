#include "collision/search/cluster_traversal.hpp"

namespace trocar::collision {
namespace {

/// Node pairs that wait: up to 64 for each of the two trees' levels.
constexpr std::size_t kWaiting = 4096;

bool is_leaf(Index node) noexcept { return (node & DopTree::kLeafBit) != 0; }
Index cluster_of(Index leaf) noexcept { return leaf & ~DopTree::kLeafBit; }

} // namespace

ClusterTraversal::ClusterTraversal() { stack_.reserve(kWaiting); }

void ClusterTraversal::start(const SurfacePair& pair) {
    stack_.clear();
    box_tests_ = 0;
    const DopTree &a = *pair.a().tree, &b = *pair.b().tree;
    if (!a.empty() && !b.empty()) stack_.push_back({a.root(), b.root()});
}

bool ClusterTraversal::advance(const SurfacePair& pair, std::size_t wanted, std::vector<ClusterPair>& out) {
    const std::size_t enough = out.size() + wanted;
    while (!stack_.empty() && out.size() < enough) {
        const ClusterPair at = stack_.back();
        stack_.pop_back();
        if (is_leaf(at.a) && is_leaf(at.b))
            pair.make_fresh(out.emplace_back(cluster_of(at.a), cluster_of(at.b))); // two surfaces of one cluster each
        else if (is_leaf(at.a) || is_leaf(at.b))
            open_node_and_leaf(pair, at, out);
        else
            open_nodes(pair, at, out);
    }
    return !stack_.empty();
}

void ClusterTraversal::push(const SurfacePair& pair, Index a, Index b, std::vector<ClusterPair>& out) {
    if (!is_leaf(a) || !is_leaf(b)) return stack_.push_back({a, b});
    const ClusterPair clusters{cluster_of(a), cluster_of(b)};
    pair.make_fresh(clusters);
    if (pair.clusters_are_near(clusters)) out.push_back(clusters);
}

void ClusterTraversal::open_node_and_leaf(const SurfacePair& pair, ClusterPair at, std::vector<ClusterPair>& out) {
    const bool a_is_leaf = is_leaf(at.a);
    DopTree &leaf_tree = a_is_leaf ? *pair.a().tree : *pair.b().tree, &node_tree = a_is_leaf ? *pair.b().tree : *pair.a().tree;
    const Index leaf = a_is_leaf ? at.a : at.b, node = a_is_leaf ? at.b : at.a;
    leaf_tree.make_fresh(cluster_of(leaf));
    node_tree.open(node);
    const auto children = node_tree.children(node);
    ++box_tests_;
    for (std::uint32_t near = pair.near(leaf_tree.cluster_bounds(cluster_of(leaf)), 1, node_tree, node); near != 0; near &= near - 1) {
        const Index child = children[static_cast<std::size_t>(__builtin_ctz(near))];
        if (child != DopTree::kNoChild) push(pair, a_is_leaf ? leaf : child, a_is_leaf ? child : leaf, out);
    }
}

void ClusterTraversal::open_nodes(const SurfacePair& pair, ClusterPair at, std::vector<ClusterPair>& out) {
    DopTree &tree_a = *pair.a().tree, &tree_b = *pair.b().tree;
    tree_a.open(at.a);
    tree_b.open(at.b);
    const std::size_t arity = tree_a.options().arity;
    const auto children_a = tree_a.children(at.a), children_b = tree_b.children(at.b);
    for (std::size_t i = 0; i < arity && children_a[i] != DopTree::kNoChild; ++i) {
        ++box_tests_;
        std::uint32_t near = pair.near(tree_a.child_bounds(at.a) + i, arity, tree_b, at.b);
        if (pair.within() && at.a == at.b) near = (near | 1u << i) & ~((1u << i) - 1u); // each pair once, and each child with itself
        for (; near != 0; near &= near - 1) {
            const Index child = children_b[static_cast<std::size_t>(__builtin_ctz(near))];
            if (child != DopTree::kNoChild) push(pair, children_a[i], child, out);
        }
    }
}

} // namespace trocar::collision
