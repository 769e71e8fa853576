// ContactSearch over a sequence of steps, with results of one step kept for the next: the same contacts, bit for bit, in a fraction of
// the time where things move little against each other. What is kept, from the outside in:
//   session   pairs of clusters whose volumes come near while they move as predicted: no refit and no traversal until it ends;
//             clusters that leave their volumes ("dangling") are traversed anew, alone or together
//   reach     pairs of features of two clusters that may come into contact before the clusters have drifted that far
//   bound     for each of them a lower bound on its distance: no elementary test before the drift has used it up (front end)
// then the elementary tests of sweep.hpp and ccd.hpp: coplanarity first, nearest points next (back end). Each vertex and edge
// belongs to one triangle, so each pair of features is tested once.
// This work is based on: Wong, "Adaptive continuous collision detection for cloth models using a skipping frame session" (2009); Curtis,
// Tamstorf, Manocha (2008) for the assignment of features. Deviates: see session_volumes.hpp, session_drift.hpp, session_pairs.hpp.
//
// Every switch but normal_cones is exact: it changes no contact. At a distance > 0 one thing may differ from ContactSearch: a pair that
// its elementary test gives up on (ExactStats::unresolved), though it is farther apart, is not tested here.
// Cost of a step: O(n) for the drifts, O(kept pairs of clusters), and pairs that must be tested. Memory: memory(); several times the
// trees', for the lists.
#pragma once

#include "base/result.hpp"
#include "collision/search/contact_search.hpp"
#include "collision/search/session_choice.hpp"
#include "collision/search/session_length.hpp"
#include "collision/search/session_pairs.hpp"
#include "collision/search/session_sides.hpp"

namespace trocar::collision {

enum class VolumeInflation : std::uint8_t {
    Predicted, // along the cluster's motion, and by what its vertices stray from it
    Paper,     // to all sides: (|v| + v_slack) dt + l, dt the length of the session
};

enum class DanglingTraversal : std::uint8_t {
    Adaptive, // alone where few dangle, partial where many do
    Alone,    // each against all trees
    Partial,  // the trees once, wherever one dangles
};

struct CoherentOptions : PairOptions {
    bool between = true; // as in SearchOptions
    bool within = true;
    TreeOptions tree; // dop 6, not fine: sessions keep boxes

    bool skipping = true;  // exact; false: every step anew ("without skipping")
    bool front_end = true; // exact; false: all features within reach are tested in every step
    bool sides = true;     // exact; false: clusters are not tested along their own normals
    VolumeInflation inflation = VolumeInflation::Predicted;
    DanglingTraversal dangling = DanglingTraversal::Adaptive;
    unsigned session_length = 0; // steps; 0: adapts
    double slack = 0.25;         // l, in mean edge lengths of the part
    double speed_slack = 0.0;    // v_slack, m per step
    double reach = 0.35;         // in mean edge lengths: of the kept pairs of features
    double list_steps = 2.0;     // that a list of them must serve to be worth its making
    /// Exact: steps in which what is kept would cost more than it saves are done by ContactSearch, whose trees are then held as well.
    bool falls_back = true;
    /// Heuristic: regions of low curvature, by continuous normal cones at the session's start, are not tested against themselves
    /// (session_cones.hpp). Loses contacts where a region's outline folds over; exact answers keep it off.
    bool normal_cones = false;
};

/// Of the last step; sizes at its end.
struct CoherenceStats {
    bool plain = false; // done by ContactSearch; nothing below but the work is told then
    double work = 0.0;  // counted, in units of session_work.hpp
    bool began_session = false;
    unsigned session_length = 0;                    // steps, of the session that runs
    std::uint64_t dangling = 0;                     // clusters that left their volumes
    std::uint64_t kept_clusters = 0;                // pairs of clusters
    std::uint64_t kept_features = 0;                // pairs of features
    std::uint64_t awake = 0;                        // pairs of clusters that were tested
    std::uint64_t gaps = 0, relisted = 0, anew = 0; // of them: far apart; got a new list; are not worth one
    std::uint64_t sides = 0;                        // of them: a plane was between them during the step
    std::uint64_t bounds = 0;                       // lower bounds computed
};

class CoherentSearch {
public:
    CoherentSearch() = default;
    CoherentSearch(CoherentSearch&&) = default;
    CoherentSearch& operator=(CoherentSearch&&) = default;

    /// surfaces   their topologies must outlive the search; body ids are their places in this list
    /// positions  [surface][vertex] shape of the trees
    /// fails      where the tree's bounds are not boxes (dop 6 without `fine`)
    [[nodiscard]] Result<void> build(std::span<const SurfaceTopology* const> surfaces, std::span<const std::span<const Vec3>> positions,
                                     const CoherentOptions& options);

    /// A step in three parts, as ContactSearch has them. Steps may begin elsewhere than the last one ended.
    /// fails      where a coordinate is not finite, or triangles are not those of build(); nothing has happened then, and the next
    ///            step may follow
    [[nodiscard]] Result<void> start_step(std::span<const SurfaceMotion> motions);
    void find_candidates();
    /// contacts   replaced: sorted as ContactSearch sorts them
    void decide(std::vector<SearchContact>& contacts);

    [[nodiscard]] const ExactStats& stats() const noexcept { return stats_; }
    [[nodiscard]] const CoherenceStats& coherence() const noexcept { return coherence_; }
    /// Counted work of the last step of a search through the same surfaces, in the units of CoherenceStats::work.
    [[nodiscard]] double plain_work(const ContactSearch& search) const noexcept;
    /// Bytes of the trees and of everything that is kept.
    [[nodiscard]] std::size_t memory() const noexcept;

private:
    struct Job { // a surface against one
        SurfaceIndex a, b;
        CandidateLists candidates;
    };
    [[nodiscard]] Result<void> check(std::span<const SurfaceMotion> motions) const;
    [[nodiscard]] Job& job_of(const KeptClusters& kept) noexcept {
        return jobs_[parts_[volumes_.part_of(kept.clusters.a)].surface * surfaces_.size() +
                     parts_[volumes_.part_of(kept.clusters.b)].surface];
    }
    [[nodiscard]] ClusterPlace place_of(Index cluster) const noexcept;
    [[nodiscard]] bool is_calm() const noexcept;
    [[nodiscard]] double least_plain_work() const noexcept;
    void find_plainly();
    void find_coherently();
    void find_drifts(std::span<const std::span<const Vec3>> from, std::span<const std::span<const Vec3>> to);
    void find_drifts_of_step();
    void jump();
    void leave_out_flat_regions();
    void predict(Index cluster, double begin) noexcept;
    [[nodiscard]] bool left_volume(Index cluster) const noexcept;
    [[nodiscard]] bool start_session();
    [[nodiscard]] bool find_session_pairs();
    [[nodiscard]] bool continue_session();
    [[nodiscard]] double drift_on(const KeptClusters& kept) const noexcept;
    void look_at(KeptClusters& kept);
    [[nodiscard]] bool stays_beside(KeptClusters& kept);
    void test_list(KeptClusters& kept, double drift);
    void make_list(KeptClusters& kept, double drift, double reach);
    void test_anew(KeptClusters& kept);
    void find_bounds(const Job& job, PairKind kind, std::span<const FeaturePair> pairs);
    void give(Job& job, PairKind kind, FeaturePair pair);
    void give_list_up(KeptClusters& kept) noexcept;

    CoherentOptions options_;
    double contact_ = 0.0; // m, distance at which an elementary test may answer
    std::vector<const SurfaceTopology*> surfaces_;
    std::vector<std::vector<Triangle>> triangles_; // [surface] as they were built
    std::vector<SurfacePart> parts_;
    std::vector<SurfaceMotion> motions_;
    std::vector<std::vector<Vec3>> last_; // [surface] where the last step ended
    std::vector<std::span<const Vec3>> from_, to_;
    bool has_last_ = false;

    SessionShapes shapes_;
    SessionVolumes volumes_;
    SessionFeatures features_;
    SessionSides sides_;
    SessionPairs pairs_;
    SessionLength lengths_;
    SessionChoice choice_;
    ContactSearch plain_;
    bool plain_step_ = false;                   // this step is ContactSearch's
    unsigned drifts_found_ = 0;                 // times that all vertices were read in this step
    unsigned plain_steps_ = 0;                  // in a row, up to this step
    double work_ = 0.0;                         // of this step, as counted
    std::size_t lists_left_ = 0;                // that may still be made in this step
    std::vector<ClusterDrift> drifts_, strays_; // [cluster] of the step; from the predicted motion, since the volume was made
    std::vector<PredictedMotion> predicted_;    // [cluster]
    std::vector<std::uint8_t> dangling_;        // [cluster]
    std::vector<Index> dangling_list_;
    std::vector<SessionPair> found_;
    std::vector<Index> regions_;             // [cluster] with normal_cones: of low curvature
    unsigned length_ = 0, session_step_ = 0; // of the session; steps of it that are done, plain ones included, or under way

    CandidateLists collected_;
    std::vector<KeptFeatures> list_;
    std::vector<FeaturePair> asked_; // whose bounds are wanted
    std::vector<Index> asked_at_;    // where they stand in their list
    std::vector<double> bounds_;
    std::vector<Job> jobs_; // [surface][surface], the first not behind the second
    std::vector<DopTree> no_trees_;
    ExactStats stats_;
    CoherenceStats coherence_;
};

} // namespace trocar::collision
