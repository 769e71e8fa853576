// All contacts of one step between and within moving surfaces, exactly: refit, find candidates, decide. Phase by phase, so that
// whoever owns a clock can time each. Same contacts for every tree, builder, instruction set and number of threads.
// At distance 0 the verdicts are those of meeting.hpp: true contacts and no others. At a distance they are those of sweep.hpp: none
// missed, and pairs up to distance + tolerance may be reported too.
#pragma once

#include "base/contact.hpp"
#include "collision/dop_tree.hpp"
#include "collision/meeting.hpp"
#include "collision/sweep_batch.hpp"

#include <span>
#include <vector>

namespace seldinger::collision {

struct SearchOptions {
    bool between = true;   // surfaces against each other
    bool within = true;    // each surface against itself; features that share a vertex do not count
    double distance = 0.0; // m, >= 0
    /// Pairs up to distance + tolerance may be reported at a distance > 0.
    double tolerance = 0.0; // m
    TreeOptions tree;
    unsigned threads = 1;
    bool simd = true;      // false: the plain twins of the broad phase's kernels
    bool all_pairs = false; // bounds cull nothing: every pair of features is decided; what the other answers are compared with
};

struct SearchStats {
    std::uint64_t box_tests = 0;     // nodes' boxes, one against all children of another counts once
    std::uint64_t cluster_pairs = 0;
    std::uint64_t candidates_vf = 0, candidates_ee = 0; // pairs whose bounds overlap
    std::uint64_t hits_vf = 0, hits_ee = 0;
    std::uint64_t exact = 0;         // candidates that whole numbers decided
    std::uint64_t unresolved = 0;    // hits at a distance > 0 that ended without a verdict
};

/// A contact's features by id as well: the triangle of a vertex-face contact, the two edges of an edge-edge one.
struct SearchContact {
    Contact contact;
    Index id_a = kNoIndex, id_b = kNoIndex; // vertex and triangle, or two edges
};

class ContactSearch {
public:
    /// surfaces   their topologies must outlive the search; body ids are their places in this list
    /// positions  [surface][vertex] shape of the trees
    void build(std::span<const SurfaceTopology* const> surfaces, std::span<const std::span<const Vec3>> positions, const SearchOptions& options);

    /// Motions must be finite, and live until the contacts are decided.
    void refit(std::span<const SurfaceMotion> motions);
    void find_candidates();
    /// Instead of refit and find_candidates: pairs that something else found, for one surface against itself or another (a <= b);
    /// decide() takes all pairs of surfaces that were given since the last start_given().
    void start_given(std::span<const SurfaceMotion> motions);
    /// face_vertex   vertices of b, faces of a
    void give_candidates(BodyId a, BodyId b, std::span<const FeaturePair> vertex_face, std::span<const FeaturePair> face_vertex,
                         std::span<const FeaturePair> edge_edge);
    /// contacts   replaced: sorted by kind (edge-edge first), bodies, ids
    void decide(std::vector<SearchContact>& contacts);

    [[nodiscard]] const SearchStats& stats() const noexcept { return stats_; }
    [[nodiscard]] std::span<const DopTree> trees() const noexcept { return trees_; }

private:
    struct ClusterPair {
        Index a, b;
    };
    struct Side {
        BodyId body;
        const DopTree* tree;
    };
    /// One surface against one, and its candidates.
    struct Job {
        BodyId a, b;
        std::vector<ClusterPair> cluster_pairs;
        std::vector<std::vector<FeaturePair>> vertex_face, face_vertex, edge_edge; // [chunk]; face_vertex: vertices of b, faces of a
    };

    void traverse(Job& job);
    void collect(Job& job, std::size_t chunk);
    void add_hits(const Job& job, bool vertex_face, bool swapped, std::span<const FeaturePair> pairs, std::vector<Sweep>& sweeps,
                  std::vector<SearchContact>& out, SearchStats& stats) const;
    template <class Work>
    void parallel(std::size_t count, const Work& work) const;

    SearchOptions options_;
    std::vector<DopTree> trees_;
    std::vector<SurfaceMotion> motions_;
    std::vector<Job> jobs_;
    std::array<float, kMaxSlabs> reach_{};
    std::vector<ClusterPair> stack_;
    SearchStats stats_;
};

} // namespace seldinger::collision
