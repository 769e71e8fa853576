#include "collision/interruptible_search.hpp"

#include <algorithm>

namespace seldinger::collision {
namespace {

/// Pairs of clusters whose candidates wait together: enough to fill the elementary tests' lanes, few enough to stay in
/// the cache, and what an interruption can be late by.
constexpr std::size_t kPairsAtOnce = 32;
/// Candidates of that many pairs of clusters, if all their features came near: vertices or edges of one against those
/// of the other.
constexpr std::size_t kMostCandidates = kPairsAtOnce * 9 * TreeOptions{}.cluster_size * TreeOptions{}.cluster_size;
/// Contacts that are sorted without growing.
constexpr std::size_t kReservedContacts = 4096;

void make_fresh(const SearchSide& side, Index cluster) noexcept {
    DopTree& tree = *side.tree;
    if (!tree.blocks_are_fresh(cluster)) tree.refit_blocks(cluster);
    if (tree.options().fine && !tree.fine_vertices_are_fresh(cluster)) tree.refit_fine_vertices(cluster, side.motion);
}

} // namespace

InterruptibleSearch::InterruptibleSearch() {
    cluster_pairs_.reserve(kPairsAtOnce + ClusterTraversal::kMostExtra);
    for (auto* list : {&candidates_.vertex_face, &candidates_.face_vertex, &candidates_.edge_edge}) list->reserve(kMostCandidates);
    found_.reserve(kReservedContacts);
}

void InterruptibleSearch::collect(const SurfacePair& pair, std::span<const ClusterPair> clusters) {
    candidates_.clear();
    for (const ClusterPair& at : clusters) {
        make_fresh(pair.a(), at.a);
        make_fresh(pair.b(), at.b);
        pair.collect(at, candidates_);
    }
}

ExactStats InterruptibleSearch::find(const SearchSide& a, const SearchSide& b, const PairOptions& options, WorkBudget& budget,
                                     std::vector<Contact>& out) {
    const SurfacePair pair(a, b, options);
    ExactStats stats;
    found_.clear();
    traversal_.start(pair);
    for (bool more = true; more && stats.finished;) {
        cluster_pairs_.clear();
        more = traversal_.advance(pair, kPairsAtOnce, cluster_pairs_);
        for (std::size_t first = 0; first < cluster_pairs_.size() && stats.finished; first += kPairsAtOnce) {
            const std::size_t count = std::min(kPairsAtOnce, cluster_pairs_.size() - first);
            collect(pair, std::span(cluster_pairs_).subspan(first, count));
            stats.finished = budget.spend(count + candidates_.size());
            if (!stats.finished) break;
            stats.cluster_pairs += count;
            stats.candidates_vf += candidates_.vertex_face.size() + candidates_.face_vertex.size();
            stats.candidates_ee += candidates_.edge_edge.size();
            pair.decide(candidates_, found_, stats);
        }
    }
    stats.box_tests = traversal_.box_tests();
    if (!stats.finished) stats.safe_fraction = 0.0;
    std::sort(found_.begin(), found_.end(), comes_before);
    for (const SearchContact& found : found_) out.push_back(found.contact);
    return stats;
}

} // namespace seldinger::collision
