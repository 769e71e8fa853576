// Stage II as in Govindaraju et al. 2005: for every ordered pair of sets, first along the axes, then by visibility queries, two passes over
// one order of slots. A prism that is free in the first pass along some direction and in the second along some direction, the same or
// another, is free of the whole other set but its own neighbour there.
// This work is based on: Govindaraju et al. (2005), section 5.2 and algorithm 5.1: 1D tests, view coherence, temporal coherence, repeated
// while the potentially colliding set shrinks. Deviates: a prism without a near pair in a set (stage I) is not queried against it; prisms
// are covered conservatively (collision/culling/cull_frame.hpp).
#pragma once

#include "collision/culling/set_culler.hpp"
#include "collision/culling/two_passes.hpp"

namespace trocar::collision {

struct QueryPlan {
    int resolution = 0; // pixels a side; 0: what the canvas prefers
    bool adapt_resolution = true;
    int views = 3;              // along the axes
    int max_rounds = 5;         // through all views, while pairs are dropped
    bool axis_tests = true;     // 1D tests first
    bool view_coherence = true; // a prism free in one pass is neither queried there again nor drawn in the other
    bool temporal_order = true; // prisms visible first in the last step come first in this one
};

struct QueryReport {
    int views = 0, rounds = 0, resolution = 0;
    std::uint64_t queries = 0; // 2.5D tests
    std::uint64_t axis_tests = 0;
    std::uint64_t drawn = 0;
    std::size_t left_after_axes = 0; // pairs that the 1D tests left
};

class QueryCuller {
public:
    /// As SetCuller::cull.
    [[nodiscard]] Result<QueryReport> cull(const CullProblem& problem, const QueryPlan& plan, VisibilityCanvas& canvas,
                                           std::vector<TrianglePair>& pairs);

private:
    /// In which of the two passes a prism is known to be free of the other set.
    struct Freedom {
        bool passes[2] = {false, false};
        bool wanted = false; // it has a pair left in the other set
        [[nodiscard]] bool everywhere() const noexcept { return passes[0] && passes[1]; }
        /// Crossed: a prism free of those before it in the one pass cannot meet them, so they need not be tested against it in the other.
        [[nodiscard]] bool need_not_be_drawn(int pass) const noexcept { return passes[1 - pass] || !wanted; }
    };
    struct Slot {
        Index prisms[2];    // live prisms of the first and of the second set, kNoIndex: none
        Freedom freedom[2]; // of prisms[s] from the other set
    };
    struct Entry { // a pair of triangles
        std::size_t pair;
        std::size_t slots[2]; // of its prism in the first set, and in the second
    };
    struct SetPair {
        Index sets[2];
        std::vector<Slot> slots;
        std::vector<Entry> entries; // those left
        [[nodiscard]] bool one_set() const noexcept { return sets[0] == sets[1]; }
        /// Sides that query: of a set with itself only one does.
        [[nodiscard]] int sides() const noexcept { return one_set() ? 1 : 2; }
    };
    struct Asked {
        std::size_t set_pair, slot;
        int side, pass;
    };

    void gather(const CullProblem& problem, const QueryPlan& plan, std::span<const TrianglePair> pairs);
    void drop_free();
    void test_axes(double reach, QueryReport& report);
    [[nodiscard]] Result<void> look(const QueryPlan& plan, const ViewDirection& direction, double reach, VisibilityCanvas& canvas,
                                    QueryReport& report);
    void note_seen(Index prism);

    std::vector<Index> live_; // of the problem's prisms, those with a pair
    std::vector<SweptCorners> prisms_;
    std::vector<SetPair> set_pairs_;
    std::size_t left_ = 0; // pairs
    /// Of the problem's prisms: their turn among those that became visible, in the last step and in this one.
    std::vector<std::uint32_t> seen_before_, seen_now_;
    std::uint32_t seen_count_ = 0;
};

} // namespace trocar::collision
