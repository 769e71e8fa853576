// Which of many bodies can touch at all: boxes sorted along one axis. Before any sphere pair is tested.
#pragma once

#include "base/box.hpp"

#include <algorithm>
#include <span>
#include <utility>
#include <vector>

namespace trocar::spheretree {

/// Keeps its order from call to call: bodies that move little cost an insertion sort that finds all in place.
/// This work is based on: Cohen, Lin, Manocha & Ponamgi 1995, "I-COLLIDE" (sorted intervals, coherence). Deviates: one axis is
/// sorted, the one along which the centres spread most at the first call; the other two are tested.
class SweepAndPrune {
public:
    /// Pairs (i < j) of boxes that overlap, touching counts, ascending. Empty boxes overlap nothing.
    void find_pairs(std::span<const Box3> boxes, std::vector<std::pair<Index, Index>>& pairs);

private:
    std::vector<Index> order_; // boxes by their lower end on axis_
    int axis_ = 0;
};

} // namespace trocar::spheretree
