// Set-based culling in four stages: which pairs of features could come into contact during a step?
// I    swept boxes of triangles, by trees: pairs of non-adjacent triangles that overlap
// II   sets of triangles, by image-space culling (optional): pairs that a view separates are dropped
// III  features of the pairs that are left, each pair of features once
// IV   features that only adjacent triangles hold
// The output holds every pair of features within the distance, whatever stage II examined; the elementary tests decide.
// This work is based on: Govindaraju et al., "Interactive collision detection between deformable models using chromatic
// decomposition" (2005); Curtis, Tamstorf, Manocha (2008) for naming one pair of triangles per pair of features; Tang, Curtis, Yoon,
// Manocha, "Interactive continuous collision detection between deformable models using connectivity-based culling" (2008): what stage
// IV tests is what they call orphans, and does not change while the connectivity stays.
#pragma once

#include "collision/culling/chromatic_sets.hpp"
#include "collision/culling/query_culler.hpp"
#include "collision/culling/set_culler.hpp"
#include "collision/ccd/sweep_batch.hpp"

#include <vector>

namespace trocar::collision {

/// Pairs of features for the elementary tests. Of one surface with itself `face_vertex` stays empty.
struct CulledCandidates {
    std::vector<FeaturePair> vertex_face; // vertex of a (or of the one surface), face of b
    std::vector<FeaturePair> face_vertex; // vertex of b, face of a: as vertex and face ids, in this order
    std::vector<FeaturePair> edge_edge;   // edge ids, a's first; of one surface ascending
};

struct CullCounts {
    std::size_t near_pairs = 0, near_triangles = 0; // after stage I: pairs, and the potentially colliding set
    std::size_t left_pairs = 0, left_triangles = 0; // after stage II
    std::size_t orphan_pairs = 0;                   // pairs of features that stage IV added
    std::uint64_t box_tests = 0;
    CullReport pictures; // of the order-free form
    QueryReport queries; // of the form of Govindaraju et al. 2005
};

/// Stages are called one after the other, so that the owner of a clock can time them.
class ChromaticCuller {
public:
    /// One surface against itself: sets by colouring. The topologies must outlive the culler.
    explicit ChromaticCuller(const SurfaceTopology& surface);
    /// One surface against another: nothing is adjacent, so each is one set.
    ChromaticCuller(const SurfaceTopology& a, const SurfaceTopology& b);

    /// Stage I. The trees must be refit to the motions. For one surface: both arguments are the same.
    /// distance    m, between surfaces that count as in contact
    /// tolerance   m, by which the elementary tests may report more; their rounding is added here
    void find_near(const SurfaceMotion& a, BoxTree& tree_a, const SurfaceMotion& b, BoxTree& tree_b, double distance, double tolerance);
    /// Stage II. Leave it out where few pairs are near. Pairs with a coordinate that is not finite stay.
    /// fails   as the backend does; the candidates are then more than they could be, and complete
    [[nodiscard]] Result<void> look(const CullPlan& plan, CullBackend& backend);
    /// The same in the order of Govindaraju et al. 2005, by visibility queries.
    [[nodiscard]] Result<void> look(const QueryPlan& plan, VisibilityCanvas& canvas);
    /// Stages III and IV.
    void find_candidates(CulledCandidates& out);

    [[nodiscard]] const CullCounts& counts() const noexcept { return counts_; }           // of the current step
    [[nodiscard]] std::span<const TrianglePair> pairs() const noexcept { return pairs_; } // triangle ids, b's own ones
    [[nodiscard]] Index set_count() const noexcept { return self() ? sets_.count() : 2; }
    [[nodiscard]] const ChromaticSets& sets() const noexcept { return sets_; } // of one surface

private:
    struct Side {
        explicit Side(const SurfaceTopology& surface);
        const SurfaceTopology* topology;
        TriangleStars stars;
        std::vector<Index> edge_begin, edge_triangles; // triangles that hold an edge, ascending
        SurfaceMotion motion;
        std::vector<SweptBox> boxes; // [vertex_count] of the current step
        [[nodiscard]] std::span<const Index> around_edge(Index edge) const noexcept {
            return std::span(edge_triangles).subspan(edge_begin[edge], edge_begin[edge + 1] - edge_begin[edge]);
        }
        [[nodiscard]] SweptBox face_box(Index face) const noexcept;
        [[nodiscard]] SweptBox edge_box(Index edge) const noexcept;
        void move(const SurfaceMotion& step);
    };
    [[nodiscard]] bool self() const noexcept { return sides_.size() == 1; }
    [[nodiscard]] const Side& side_b() const noexcept { return sides_.back(); }
    template <class Cull>
    [[nodiscard]] Result<void> cull_pairs(Cull&& cull);
    [[nodiscard]] bool speaks_for_vertex(const Side& side, Index vertex, Index triangle, Index face) const noexcept;
    [[nodiscard]] bool speaks_for_edges(Index edge_a, Index edge_b, const TrianglePair& pair) const noexcept;
    void add_features(const TrianglePair& pair, CulledCandidates& out) const;
    void add_vertex_face(const Side& vertices, const Side& faces, Index triangle, Index face, std::vector<FeaturePair>& out) const;
    template <class Visit>
    void for_each_orphan(const TrianglePair& pair, Visit&& visit) const;
    void gather_orphans();
    void add_orphans(CulledCandidates& out);
    [[nodiscard]] std::size_t count_triangles() const;

    std::vector<Side> sides_; // one or two
    ChromaticSets sets_;
    double distance_ = 0.0, reach_ = 0.0;
    std::vector<TrianglePair> pairs_, adjacent_;
    /// Orphans never change, so they are listed once; not where that would take the square of a huge valence. Then adjacent pairs
    /// that come near are examined in every step.
    bool orphans_listed_ = false;
    std::vector<FeaturePair> orphan_vertex_face_, orphan_edge_edge_;
    NearTriangles near_;
    SetCuller culler_;
    QueryCuller query_culler_;
    CullCounts counts_;
};

} // namespace trocar::collision
