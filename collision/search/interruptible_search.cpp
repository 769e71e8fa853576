#include "collision/search/interruptible_search.hpp"

#include <algorithm>

namespace trocar::collision {
namespace {

/// Pairs of clusters whose candidates are batched: enough to fill the elementary tests' lanes, few enough to stay in
/// the cache, and the most that an interruption can be late by.
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

void InterruptibleSearch::reserve_two_stages(std::size_t candidates) {
    for (auto* list : {&all_.vertex_face, &all_.face_vertex, &all_.edge_edge}) list->reserve(candidates);
}

void InterruptibleSearch::collect(const SurfacePair& pair, std::span<const ClusterPair> clusters, CandidateLists& out) {
    for (const ClusterPair& at : clusters) {
        if (pair.clusters_are_apart(at)) continue;
        make_fresh(pair.a(), at.a);
        make_fresh(pair.b(), at.b);
        pair.collect(at, out);
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
            candidates_.clear();
            collect(pair, std::span(cluster_pairs_).subspan(first, count), candidates_);
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
    put_out(out);
    return stats;
}

void InterruptibleSearch::put_out(std::vector<Contact>& out) {
    std::sort(found_.begin(), found_.end(), comes_before);
    for (const SearchContact& found : found_) out.push_back(found.contact);
}

/// Candidates in parts, so that an answer that comes meanwhile still saves the rest.
void InterruptibleSearch::decide_all(const SurfacePair& pair, StageTwo& stage, ExactStats& stats) {
    constexpr std::size_t kAtOnce = 1024;
    std::size_t candidate = 0;
    using List = std::vector<FeaturePair> CandidateLists::*;
    for (const List list : {&CandidateLists::vertex_face, &CandidateLists::face_vertex, &CandidateLists::edge_edge}) {
        const std::vector<FeaturePair>& from = all_.*list;
        for (std::size_t first = 0; first < from.size(); first += kAtOnce) {
            stage.poll();
            candidates_.clear();
            const std::size_t count = std::min(kAtOnce, from.size() - first);
            for (std::size_t k = first; k < first + count; ++k, ++candidate)
                if (!stage.is_apart(candidate)) (candidates_.*list).push_back(from[k]);
            skipped_ += count - candidates_.size();
            pair.decide(candidates_, found_, stats);
        }
    }
}

ExactStats InterruptibleSearch::find(const SearchSide& a, const SearchSide& b, const PairOptions& options, StageTwo& stage,
                                     WorkBudget& budget, std::vector<Contact>& out) {
    const SurfacePair pair(a, b, options);
    ExactStats stats;
    found_.clear();
    all_.clear();
    skipped_ = 0;
    traversal_.start(pair);
    for (bool more = true; more && stats.finished;) {
        cluster_pairs_.clear();
        more = traversal_.advance(pair, kPairsAtOnce, cluster_pairs_);
        const std::size_t before = all_.size();
        collect(pair, cluster_pairs_, all_);
        stats.finished = budget.spend(cluster_pairs_.size() + all_.size() - before);
        stats.cluster_pairs += cluster_pairs_.size();
    }
    stats.box_tests = traversal_.box_tests();
    stats.candidates_vf = all_.vertex_face.size() + all_.face_vertex.size();
    stats.candidates_ee = all_.edge_edge.size();
    if (stats.finished) {
        stage.begin(pair, all_, options, budget);
        decide_all(pair, stage, stats);
        stage.end();
    } else {
        stats.safe_fraction = 0.0;
    }
    put_out(out);
    return stats;
}

} // namespace trocar::collision
