#include "spheretree/traverse/sweep_and_prune.hpp"

namespace trocar::spheretree {

namespace {

int widest_axis(std::span<const Box3> boxes) {
    Box3 centres;
    for (const Box3& box : boxes)
        if (!box.empty()) centres.add(box.centre());
    int axis = 0;
    for (int k = 1; k < 3; ++k)
        if (centres.extent()[k] > centres.extent()[axis]) axis = k;
    return axis;
}

} // namespace

void SweepAndPrune::find_pairs(std::span<const Box3> boxes, std::vector<std::pair<Index, Index>>& pairs) {
    if (order_.size() != boxes.size()) {
        order_.resize(boxes.size());
        for (Index i = 0; i < order_.size(); ++i) order_[i] = i;
        axis_ = widest_axis(boxes);
    }
    const auto before = [&](Index i, Index j) {
        const double x = boxes[i].lo[axis_], y = boxes[j].lo[axis_];
        return x != y ? x < y : i < j;
    };
    for (std::size_t k = 1; k < order_.size(); ++k)
        for (std::size_t at = k; at > 0 && before(order_[at], order_[at - 1]); --at) std::swap(order_[at], order_[at - 1]);
    pairs.clear();
    for (std::size_t k = 0; k < order_.size(); ++k) {
        const Box3& box = boxes[order_[k]];
        if (box.empty()) continue;
        for (std::size_t next = k + 1; next < order_.size() && boxes[order_[next]].lo[axis_] <= box.hi[axis_]; ++next)
            if (!boxes[order_[next]].empty() && box.overlaps(boxes[order_[next]])) pairs.push_back(std::minmax(order_[k], order_[next]));
    }
    std::sort(pairs.begin(), pairs.end());
}

} // namespace trocar::spheretree
