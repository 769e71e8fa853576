// Stage II, free of order: a pair of triangles survives unless in some view one of them is free of the other's whole set, its one
// neighbour there left out. Views after views; what was proven apart is neither drawn nor queried again, so later views are less occluded.
// This work is based on: Govindaraju et al. (2005), section 5.2. Deviates: the two nearest per pixel and set instead of two passes with an
// occlusion query per triangle; both passes come from the same view (theirs may come from two).
#pragma once

#include "collision/culling/cull_view.hpp"
#include "collision/culling/near_triangles.hpp"

namespace trocar::collision {

struct CullPlan {
    CullMemory memory = CullMemory::Intervals;
    int resolution = 0;           // pixels a side; 0: what the backend prefers
    bool reversed_views = false;  // three more views: of use with CullMemory::Fronts
    int max_rounds = 3;           // through all views
    double worthwhile = 0.05;     // another round only if the last one dropped more than this share of the pairs
    bool adapt_resolution = true; // fewer pixels where triangles are large in the picture
};

struct CullReport {
    int views = 0, rounds = 0;
    std::uint64_t questions = 0;     // 2.5D tests
    std::uint64_t drawn = 0;         // prisms, over all views
    int resolution = 0;              // the least that a view was given
    unsigned lowered_for_memory = 0; // times that the device had no memory for a picture, and a smaller one was taken
};

/// By how much prisms must grow, m, so that image space separates only what the elementary tests would not report.
/// distance    m, between surfaces that count as in contact
/// tolerance   m, by which the elementary tests may report more; their rounding, relative to the features' extent, is added here: see
///             SweepLimits.tolerance
[[nodiscard]] constexpr double reach_of_contact(double distance, double tolerance, double extent) noexcept {
    constexpr double kTestRounding = 1e-12;
    return 0.5 * (distance + tolerance + kTestRounding * extent);
}

/// The prisms of one problem by index; corners and set_of beside them.
struct CullProblem {
    std::span<const SweptCorners> prisms; // finite
    std::span<const Triangle> corners;    // vertex ids; surfaces that are not one must not share any
    std::span<const Index> set_of;
    Index set_count = 0;
    double reach = 0.0; // m, half the distance that counts as contact, tolerance included
};

class SetCuller {
public:
    /// Nothing is allocated for problems of this size afterwards.
    void reserve(std::size_t prisms, std::size_t pairs, std::size_t sets);
    /// pairs   of prism indices; those proven farther apart than twice the reach during the whole step are taken out, the order stays
    /// fails   as the backend does; the pairs are then those of the last view that worked, and still valid
    [[nodiscard]] Result<CullReport> cull(const CullProblem& problem, const CullPlan& plan, CullBackend& backend,
                                          std::vector<TrianglePair>& pairs);

private:
    void gather_live(const CullProblem& problem, std::span<const TrianglePair> pairs);
    void gather_questions(std::span<const TrianglePair> pairs, Index set_count);
    [[nodiscard]] Result<void> look(const CullProblem& problem, const ViewDirection& direction, const CullPlan& plan, CullBackend& backend,
                                    std::vector<TrianglePair>& pairs, CullReport& report);

    // of the current view
    CullView view_;
    std::vector<Index> place_; // prism to its place among those with a pair left
    std::vector<Index> live_set_;
    std::vector<std::size_t> entry_begin_;
    std::vector<std::size_t> entries_, entry_question_, next_; // entry 2 i + side of pair i
    std::vector<std::pair<Index, std::size_t>> asked_;         // of a prism: set it was last asked for, and the question
};

} // namespace trocar::collision
