// The exact search between two moving surfaces, or within one, in the pieces that its drivers put together: pairs of
// clusters whose bounds come near, the features of those that do, and the verdict on each pair of features. No piece
// allocates once its lists have their capacity.
#pragma once

#include "base/contact.hpp"
#include "collision/bvh/dop_tree.hpp"
#include "collision/ccd/ccd.hpp"

#include <array>
#include <vector>

namespace trocar::collision {

/// What counts as a contact, and by which means it is found.
struct PairOptions {
    double distance = 0.0; // m, >= 0
    /// Pairs up to distance + tolerance may be reported at a distance > 0.
    double tolerance = 0.0; // m
    bool simd = true;       // false: the scalar references of the broad phase's kernels
    bool all_pairs = false; // bounds cull nothing: every pair of features is decided; what the other answers are compared with
    /// Exact: pairs of clusters of fine trees are tested along their faces' own normals before their features are (face_planes.hpp).
    bool planes = true;
};

/// One surface in a search: its motion, and its tree, refitted to that motion.
struct SearchSide {
    Thing thing; // written into the contacts
    DopTree* tree = nullptr;
    SurfaceMotion motion;
};

struct ClusterPair {
    Index a, b;
};

/// Pairs of features whose bounds come near.
struct CandidateLists {
    std::vector<FeaturePair> vertex_face, face_vertex, edge_edge; // face_vertex: vertices of b, faces of a

    void clear() noexcept {
        for (auto* list : {&vertex_face, &face_vertex, &edge_edge}) list->clear();
    }
    [[nodiscard]] std::size_t size() const noexcept { return vertex_face.size() + face_vertex.size() + edge_edge.size(); }
};

struct ExactStats {
    std::uint64_t box_tests = 0;                        // nodes' boxes, one against all children of another counts once
    std::uint64_t cluster_pairs = 0;                    // pairs of leaves that came near
    std::uint64_t candidates_vf = 0, candidates_ee = 0; // pairs of features whose bounds came near: elementary tests
    std::uint64_t hits_vf = 0, hits_ee = 0;
    std::uint64_t exact = 0;      // candidates decided in exact integer arithmetic
    std::uint64_t unresolved = 0; // hits at a distance > 0 that ended without a verdict
    double safe_fraction = 1.0;   // if all vertices of both bodies move by this share of their step, none is proven to
                                  // touch: the smallest safe time. 0 if the search was interrupted
    bool finished = true;         // false: the budget ran out and contacts may be missing; give more, or move nothing

    /// Of another part of the same search.
    void add(const ExactStats& part) noexcept;
};

/// A contact's features by id as well: the triangle of a vertex-face contact, the two edges of an edge-edge one.
struct SearchContact {
    Contact contact;
    Index id_a = kNoIndex, id_b = kNoIndex; // vertex and triangle, or two edges
};

/// Kind (edge-edge first), bodies, ids: an order that no tree or thread changes.
[[nodiscard]] bool comes_before(const SearchContact& a, const SearchContact& b) noexcept;

class SurfacePair {
public:
    SurfacePair() = default;
    /// Both sides the same: the surface against itself; features that share a vertex do not count then. Trees have the
    /// same options.
    SurfacePair(const SearchSide& a, const SearchSide& b, const PairOptions& options) noexcept;

    [[nodiscard]] const SearchSide& a() const noexcept { return a_; }
    [[nodiscard]] const SearchSide& b() const noexcept { return b_; }
    [[nodiscard]] bool within() const noexcept { return a_.tree == b_.tree; }

    /// Is it proven that no feature of one comes near one of the other? Never where the trees are not fine, or options.planes is off.
    [[nodiscard]] bool clusters_are_apart(ClusterPair clusters) const noexcept;
    /// Appends the candidates of a pair of clusters, whose blocks and vertices must be fresh.
    void collect(ClusterPair clusters, CandidateLists& out) const;
    /// Decides the candidates and appends contacts in their order. Counts hits, not candidates.
    void decide(const CandidateLists& candidates, std::vector<SearchContact>& out, ExactStats& stats) const;

private:
    friend class ClusterTraversal;
    void make_fresh(ClusterPair clusters) const noexcept {
        a_.tree->make_fresh(clusters.a);
        b_.tree->make_fresh(clusters.b);
    }
    [[nodiscard]] bool clusters_are_near(ClusterPair clusters) const noexcept; // refits their fine bounds where they are not fresh
    template <std::size_t CornersA, std::size_t CornersB>
    [[nodiscard]] std::size_t keep_near(const DopTree& tree_a, const DopTree& tree_b, std::span<FeaturePair> pairs) const noexcept;
    [[nodiscard]] std::uint32_t near(const float* box, std::size_t stride, const DopTree& tree, Index node) const noexcept;
    void decide_list(bool vertex_face, bool swapped, std::span<const FeaturePair> pairs, std::vector<SearchContact>& out,
                     ExactStats& stats) const;
    struct Verdicts;
    void sweep(bool vertex_face, const SearchSide& a, const SearchSide& b, std::span<const FeaturePair> pairs, Verdicts& out) const;
    static void make_vertex_face(const SearchSide& a, const SearchSide& b, FeaturePair pair, const CcdResult& ccd, SearchContact& found);
    void make_edge_edge(FeaturePair pair, const CcdResult& ccd, SearchContact& found) const;

    SearchSide a_, b_;
    PairOptions options_;
    std::array<float, kMaxSlabs> reach_{}; // m along each direction, times the direction's length, rounded up
    FineReach fine_reach_{};
    bool fine_ = false;
};

} // namespace trocar::collision
