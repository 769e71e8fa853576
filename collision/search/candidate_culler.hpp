// Stage II inside an exact search between two surfaces: pairs of features that the hierarchies left, culled in image space by the triangles
// that hold them. A feature lies in every triangle that holds it, so one of them represents it; what is proven apart for the triangles is
// apart for the features. Nothing is adjacent between two surfaces, so each is one set.
// This work is based on: Govindaraju et al. (2005), section 5; Curtis, Tamstorf, Manocha (2008) for representative triangles.
#pragma once

#include "base/work_budget.hpp"
#include "collision/culling/set_culler.hpp"
#include "collision/search/surface_pair.hpp"

namespace trocar::collision {

/// Input and answer of one culling pass: it points to nothing outside, so another thread can process it while the surfaces move on.
struct CullSnapshot {
    std::vector<SweptCorners> prisms;
    std::vector<Triangle> corners;
    std::vector<Index> set_of;       // 0: of a, 1: of b
    std::vector<TrianglePair> pairs; // of prisms, each once, ascending
    double reach = 0.0;              // m
    // the answer
    std::vector<std::uint8_t> apart; // [pair_count]
    CullReport report;

    void reserve(std::size_t prism_count, std::size_t pair_count);
    /// fails   as the backend does: nothing is apart then
    [[nodiscard]] Result<void> look(const CullPlan& plan, CullBackend& backend);

private:
    SetCuller culler_;
    std::vector<TrianglePair> left_;
};

class CandidateCuller {
public:
    /// Nothing is allocated for so many candidates of surfaces of so many triangles afterwards.
    void reserve(std::size_t candidates, std::size_t triangles_a, std::size_t triangles_b);
    /// Makes the snapshot of these candidates. Features whose triangle has a coordinate that is not finite are in no pair.
    void gather(const SurfacePair& pair, const CandidateLists& candidates, const PairOptions& options, CullSnapshot& snapshot);
    /// Of a candidate, counted through vertex_face, face_vertex, edge_edge: its pair in the snapshot, kNoIndex: none.
    [[nodiscard]] Index pair_of(std::size_t candidate) const noexcept { return pair_of_[candidate]; }

private:
    struct Key {
        Index a, b; // triangles
        std::size_t candidate;
    };
    [[nodiscard]] static Index prism_of(const SearchSide& side, Index triangle, std::vector<Index>& place, Index set,
                                        CullSnapshot& snapshot);

    std::vector<Key> keys_;
    std::vector<Index> pair_of_;
    std::vector<Index> place_a_, place_b_; // of triangles among the prisms
};

/// A candidate filter: may learn, while an exact search runs, that some of its candidates are apart.
class StageTwo {
public:
    virtual ~StageTwo() = default;
    /// The broad phase is done. May cull here, start culling on another thread, or do nothing; the cost is charged to the budget.
    virtual void begin(const SurfacePair& pair, const CandidateLists& candidates, const PairOptions& options, WorkBudget& budget) = 0;
    /// Some candidates will be decided next: has an answer arrived since?
    virtual void poll() = 0;
    [[nodiscard]] virtual bool is_apart(std::size_t candidate) const noexcept = 0;
    /// All are decided; an answer that has not arrived is late.
    virtual void end() = 0;
};

} // namespace trocar::collision
