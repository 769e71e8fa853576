// The exact search inside a step loop: one pair of surfaces at a time, within a budget of work, in a fixed amount of
// memory.
#pragma once

#include "base/work_budget.hpp"
#include "collision/search/candidate_culler.hpp"
#include "collision/search/cluster_traversal.hpp"

#include <vector>

namespace trocar::collision {

class InterruptibleSearch {
public:
    /// Sizes its buffers; nothing allocates after it but the list of contacts, where it has to grow.
    InterruptibleSearch();

    /// For searches in two stages: so many candidates of each kind wait without growing.
    void reserve_two_stages(std::size_t candidates);

    /// Contacts of a against b (or of one surface with itself, when both are the same), appended to out: sorted as
    /// ContactSearch sorts them, the same whatever the trees. Both trees must be refit to these motions. In a
    /// vertex-face contact a of the Contact is the vertex's body, whichever argument that was. Coordinates that
    /// are not finite give unresolved contacts at a distance > 0; at distance 0 they must not occur. budget   one unit
    /// per pair of clusters and one per elementary test
    ExactStats find(const SearchSide& a, const SearchSide& b, const PairOptions& options, WorkBudget& budget, std::vector<Contact>& out);

    /// The same contacts of two different surfaces: all candidates first, then those that `stage` does not know to be apart are decided.
    /// Memory grows with the candidates, beyond what was reserved. Interrupted, it has decided nothing. budget   as above, skipped tests included, and what
    /// the stage spends
    ExactStats find(const SearchSide& a, const SearchSide& b, const PairOptions& options, StageTwo& stage, WorkBudget& budget,
                    std::vector<Contact>& out);
    [[nodiscard]] std::uint64_t skipped() const noexcept { return skipped_; } // candidates of the last search that were apart

private:
    void collect(const SurfacePair& pair, std::span<const ClusterPair> clusters, CandidateLists& out);
    void decide_all(const SurfacePair& pair, StageTwo& stage, ExactStats& stats);
    void put_out(std::vector<Contact>& out);

    ClusterTraversal traversal_;
    std::vector<ClusterPair> cluster_pairs_;
    CandidateLists candidates_;
    CandidateLists all_; // of a search in two stages
    std::uint64_t skipped_ = 0;
    std::vector<SearchContact> found_;
};

} // namespace trocar::collision
