// The older baseline of Wong 2009, built here for measurement: pairs of triangles from a tree down to single triangles, all 15 pairs of
// their features, each tested once because what was tested is marked.
// source   Wong, Baciu, "A randomized marking scheme for continuous collision detection in simulation of deformable surfaces" (2006).
//          Deviates: marks are in a hash table over pairs, not drawn at random per feature; every contact is found.
#pragma once

#include "collision/search/cluster_traversal.hpp"
#include "collision/search/coherent_search.hpp"

namespace trocar::engine {

class MarkedSearch {
public:
    void build(std::span<const collision::SurfaceTopology* const> surfaces, std::span<const std::span<const Vec3>> positions);
    void step(std::span<const collision::SurfaceMotion> motions, std::vector<collision::SearchContact>& contacts);

    [[nodiscard]] const collision::ExactStats& stats() const noexcept { return stats_; }
    [[nodiscard]] static collision::CoherenceStats coherence() noexcept { return {}; }
    [[nodiscard]] std::size_t memory() const noexcept;

private:
    struct Side {
        const collision::SurfaceMotion* motion;
        Index triangle;
    };
    void add_triangle_pair(const Side& a, const Side& b, bool within);
    void add_vertex_faces(const Side& vertices, const Side& face, bool within, std::vector<collision::FeaturePair>& out);
    [[nodiscard]] bool mark(std::uint64_t key); // false: it was marked

    std::vector<collision::DopTree> trees_;
    collision::ClusterTraversal traversal_;
    std::vector<collision::ClusterPair> pairs_;
    collision::CandidateLists candidates_;
    std::vector<std::uint64_t> marks_; // [2^n] open addressing, 0: free
    std::size_t marked_ = 0;
    collision::ExactStats stats_;
};

} // namespace trocar::engine
