// The exact search inside a step loop: one pair of surfaces at a time, within a budget of work, in a fixed amount of
// memory.
#pragma once

#include "base/work_budget.hpp"
#include "collision/cluster_traversal.hpp"

#include <vector>

namespace seldinger::collision {

class InterruptibleSearch {
public:
    /// Sizes its buffers; nothing allocates after it but the list of contacts, where it has to grow.
    InterruptibleSearch();

    /// Contacts of a against b (or of one surface with itself, when both are the same), appended to out: sorted as
    /// ContactSearch sorts them, the same whatever the trees. Both trees must be refit to these motions. In a
    /// vertex-face contact body_a of the Contact is the vertex's body, whichever argument that was. Coordinates that
    /// are not finite give unresolved contacts at a distance > 0; at distance 0 they must not occur. budget   one unit
    /// per pair of clusters and one per elementary test
    ExactStats find(const SearchSide& a, const SearchSide& b, const PairOptions& options, WorkBudget& budget, std::vector<Contact>& out);

private:
    void collect(const SurfacePair& pair, std::span<const ClusterPair> clusters);

    ClusterTraversal traversal_;
    std::vector<ClusterPair> cluster_pairs_;
    CandidateLists candidates_;
    std::vector<SearchContact> found_;
};

} // namespace seldinger::collision
