// All contacts of one step between and within moving surfaces, exactly: refit, find candidates, decide. Phase by phase,
// so that the owner of a clock can time each, on any number of threads. Same contacts, same bits, for every tree,
// builder, instruction set and number of threads. At distance 0 the verdicts are those of ccd.hpp: true contacts
// and no others. At a distance they are those of sweep.hpp: none missed, and pairs up to distance + tolerance may be
// reported too.
#pragma once

#include "collision/search/cluster_traversal.hpp"

#include <span>
#include <vector>

namespace trocar::collision {

struct SearchOptions : PairOptions {
    bool between = true; // surfaces against each other
    bool within = true;  // each surface against itself; features that share a vertex do not count
    TreeOptions tree;
    unsigned threads = 1;
};

class ContactSearch {
public:
    /// surfaces   their topologies must outlive the search; body ids are their places in this list
    /// positions  [surface][vertex] shape of the trees
    void build(std::span<const SurfaceTopology* const> surfaces, std::span<const std::span<const Vec3>> positions,
               const SearchOptions& options);

    /// Motions must be finite, and live until the contacts are decided.
    void refit(std::span<const SurfaceMotion> motions);
    void find_candidates();
    /// Instead of refit and find_candidates: pairs from another broad phase, for one surface against itself or another
    /// (a <= b); decide() takes all pairs of surfaces that were given since the last start_given().
    void start_given(std::span<const SurfaceMotion> motions);
    /// face_vertex   vertices of b, faces of a
    void give_candidates(SurfaceIndex a, SurfaceIndex b, std::span<const FeaturePair> vertex_face, std::span<const FeaturePair> face_vertex,
                         std::span<const FeaturePair> edge_edge);
    /// contacts   replaced: sorted by kind (edge-edge first), bodies, ids
    void decide(std::vector<SearchContact>& contacts);

    [[nodiscard]] const ExactStats& stats() const noexcept { return stats_; }
    [[nodiscard]] std::span<const DopTree> trees() const noexcept { return trees_; }

private:
    /// Work of one thread at a time, with its results. The chunks, not the threads, give the order of the answer.
    struct Chunk {
        CandidateLists candidates;
        std::vector<SearchContact> contacts;
        ExactStats stats;
    };
    /// One surface against one.
    struct Job {
        SurfaceIndex a, b;
        SurfacePair pair;
        std::vector<ClusterPair> cluster_pairs;
        std::vector<Chunk> chunks; // the first chunk_count are in use
        std::size_t chunk_count = 0;
    };

    void set_motions(std::span<const SurfaceMotion> motions);
    void use_chunks(Job& job, std::size_t count);
    void refit_blocks(const Job& job);
    template <class Work>
    void parallel(std::size_t count, const Work& work) const;

    SearchOptions options_;
    std::vector<DopTree> trees_;
    std::vector<SurfaceMotion> motions_;
    std::vector<Job> jobs_;
    ClusterTraversal traversal_;
    std::vector<std::vector<Index>> stale_;         // [tree] clusters whose blocks are needed, each once
    std::vector<std::vector<std::uint8_t>> wanted_; // [tree][cluster] it is among them
    ExactStats stats_;
};

} // namespace trocar::collision
