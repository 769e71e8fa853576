// Exact contacts of moving surfaces: two trees are compared, the features of clusters that come near become candidates, and the
// elementary tests decide. Every vertex-face and edge-edge pair is tested once, and none is missed.
#pragma once

#include "base/contact.hpp"
#include "base/work_budget.hpp"
#include "collision/box_tree.hpp"
#include "collision/sweep_batch.hpp"

#include <span>
#include <vector>

namespace seldinger::collision {

struct ExactOptions {
    BodyId body_a = 0, body_b = 1; // written into the contacts; one body against itself uses body_a
    SweepLimits limits;            // limits.distance is the contact distance between the surfaces
};

struct ExactStats {
    std::uint64_t box_pairs = 0;     // pairs of tree nodes looked at
    std::uint64_t cluster_pairs = 0; // pairs of clusters that came near
    std::uint64_t candidates_vf = 0, candidates_ee = 0; // elementary tests: the cost in next step's prediction
    std::uint64_t hits_vf = 0, hits_ee = 0;
    std::uint64_t unresolved = 0; // among the hits
    double safe_fraction = 1.0;   // if all vertices of both bodies move by this share of their step, none is proven to touch:
                                  // the smallest safe time. 0 if the budget ran out
    bool finished = true;         // false: the budget ran out and contacts may be missing; give more, or move nothing
};

class ContactFinder {
public:
    /// Contacts of a against b, appended to out. Both trees must be refit to these motions. In a vertex-face contact body_a of the
    /// Contact is the vertex's body, whichever argument that was. Contact.time is Sweep.time; gap is along the normal between the
    /// two nearest points of that time where they stand at t1, so negative when they would have passed each other.
    /// budget   one unit per pair of clusters and one per elementary test
    /// cost     no allocation once its buffers and out have grown
    ExactStats find(const SurfaceMotion& a, BoxTree& tree_a, const SurfaceMotion& b, BoxTree& tree_b, const ExactOptions& options,
                    WorkBudget& budget, std::vector<Contact>& out);
    /// One surface against itself. Pairs that share a vertex are left out.
    ExactStats find_self(const SurfaceMotion& a, BoxTree& tree_a, const ExactOptions& options, WorkBudget& budget,
                         std::vector<Contact>& out);

    /// Sweep.safe_time of each contact that the last call appended, in its order.
    [[nodiscard]] std::span<const double> safe_times() const noexcept { return safe_times_; }

private:
    struct Side {
        const SurfaceMotion& motion;
        BoxTree& tree;
        BodyId body;
    };
    struct NodePair {
        Index a, b;
    };
    struct Search;

    void traverse(Search& search);
    bool collect_candidates(Search& search, Index cluster_a, Index cluster_b); // false: budget ran out
    void collect_vertex_face(const Search& search, const Side& vertex_side, Index vertex_cluster, const Side& face_side,
                             Index face_cluster, std::vector<FeaturePair>& pairs);
    void collect_edge_edge(const Search& search, Index cluster_a, Index cluster_b);
    void test_candidates(Search& search);
    void test_vertex_face(Search& search, const Side& vertex_side, const Side& face_side, std::vector<FeaturePair>& pairs);
    void test_edge_edge(Search& search);

    std::vector<NodePair> stack_;
    std::vector<FeaturePair> vertex_face_, face_vertex_, edge_edge_; // candidates waiting for their test
    std::vector<Sweep> sweeps_;
    std::vector<double> safe_times_;
};

} // namespace seldinger::collision
