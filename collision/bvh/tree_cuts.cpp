#include "collision/bvh/tree_cuts.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::collision {
namespace {

CutItem make_item(const Triangle& t, std::span<const Vec3> positions) {
    CutItem item;
    for (const Index v : t) item.box.add(positions[v]);
    const Vec3 centre = (positions[t[0]] + positions[t[1]] + positions[t[2]]) / 3.0;
    if (is_finite(centre))
        item.centre = centre; // an order needs comparable numbers
    else
        item.box = Box3();
    return item;
}

double half_area(const Box3& box) noexcept {
    if (box.empty()) return 0.0;
    const Vec3 e = box.extent();
    return e[0] * e[1] + e[1] * e[2] + e[2] * e[0];
}

/// Where a span of triangles is cut; 0 or the whole where no cut is good.
using Cut = std::size_t;

Cut cut_median(std::span<Index> order, std::span<const CutItem> items, std::size_t granule) {
    Box3 bounds;
    for (const Index id : order) bounds.add(items[id].centre);
    int axis = 0;
    bounds.extent().maxCoeff(&axis);
    const std::size_t groups = (order.size() + granule - 1) / granule;
    const std::size_t middle = groups > 1 ? groups / 2 * granule : order.size() / 2;
    std::nth_element(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(middle), order.end(), [&](Index a, Index b) {
        return items[a].centre[axis] != items[b].centre[axis] ? items[a].centre[axis] < items[b].centre[axis] : a < b;
    });
    return middle;
}

constexpr int kBins = 16;

struct BinCut {
    double cost = std::numeric_limits<double>::infinity();
    int axis = 0, bin = 0;
};

int bin_of(double at, double from, double scale) noexcept { return std::clamp(static_cast<int>((at - from) * scale), 0, kBins - 1); }

BinCut best_bin(std::span<const Index> order, std::span<const CutItem> items, const Box3& centres) {
    BinCut best;
    for (int axis = 0; axis < 3; ++axis) {
        const double extent = centres.extent()[axis];
        if (!(extent > 0.0)) continue;
        const double scale = kBins / extent;
        if (!std::isfinite(scale)) continue;
        std::array<Box3, kBins> boxes;
        std::array<std::size_t, kBins> counts{};
        for (const Index id : order) {
            const auto bin = static_cast<std::size_t>(bin_of(items[id].centre[axis], centres.lo[axis], scale));
            boxes[bin].add(items[id].box);
            ++counts[bin];
        }
        std::array<double, kBins> right{};
        Box3 box;
        std::size_t count = 0;
        for (std::size_t bin = kBins - 1; bin > 0; --bin) {
            box.add(boxes[bin]);
            count += counts[bin];
            right[bin] = half_area(box) * static_cast<double>(count);
        }
        box = Box3();
        count = 0;
        for (std::size_t bin = 0; bin + 1 < kBins; ++bin) {
            box.add(boxes[bin]);
            count += counts[bin];
            const double cost = half_area(box) * static_cast<double>(count) + right[bin + 1];
            if (count > 0 && count < order.size() && cost < best.cost) best = {cost, axis, static_cast<int>(bin)};
        }
    }
    return best;
}

Cut cut_sah(std::span<Index> order, std::span<const CutItem> items, std::size_t granule) {
    Box3 centres;
    for (const Index id : order) centres.add(items[id].centre);
    const BinCut cut = best_bin(order, items, centres);
    if (!std::isfinite(cut.cost)) return cut_median(order, items, granule);
    const double scale = kBins / centres.extent()[cut.axis];
    const auto end = std::stable_partition(
        order.begin(), order.end(), [&](Index id) { return bin_of(items[id].centre[cut.axis], centres.lo[cut.axis], scale) <= cut.bin; });
    return static_cast<Cut>(end - order.begin());
}

/// Across the widest slab, widths divided by the length of its direction.
Cut cut_middle(std::span<Index> order, std::span<const CutItem> items, std::span<const Triangle> triangles, std::span<const Vec3> positions,
               Directions directions, std::size_t granule) {
    double widest = -1.0, middle = 0.0;
    std::array<int, 3> along{};
    const auto project = [](const std::array<int, 3>& n, const Vec3& p) { return n[0] * p[0] + n[1] * p[1] + n[2] * p[2]; };
    for (const auto& n : directions) {
        double lo = std::numeric_limits<double>::infinity(), hi = -lo;
        for (const Index id : order)
            for (const Index v : triangles[id]) {
                const double at = project(n, positions[v]);
                lo = std::min(lo, at);
                hi = std::max(hi, at);
            }
        const double width = (hi - lo) / direction_length(n);
        if (width > widest) {
            widest = width;
            along = n;
            middle = 0.5 * (lo + hi);
        }
    }
    std::vector<Index> sides[3]; // below, cut, above
    for (const Index id : order) {
        int below = 0;
        for (const Index v : triangles[id]) below += project(along, positions[v]) < middle;
        sides[below == 3 ? 0 : below == 0 ? 2 : 1].push_back(id);
    }
    const bool cut_goes_below = sides[0].size() <= sides[2].size();
    auto out = std::copy(sides[0].begin(), sides[0].end(), order.begin());
    out = std::copy(sides[1].begin(), sides[1].end(), out);
    std::copy(sides[2].begin(), sides[2].end(), out);
    const Cut cut = sides[0].size() + (cut_goes_below ? sides[1].size() : 0);
    return cut == 0 || cut == order.size() ? cut_median(order, items, granule) : cut;
}

} // namespace

std::vector<CutItem> make_cut_items(std::span<const Triangle> triangles, std::span<const Vec3> positions) {
    std::vector<CutItem> items;
    items.reserve(triangles.size());
    for (const Triangle& t : triangles) items.push_back(make_item(t, positions));
    return items;
}

CutParts cut_into_parts(const CutPlan& plan, std::span<Index> order, std::size_t arity, std::size_t leaf_size) {
    CutParts parts;
    parts.part[parts.count++] = order;
    while (parts.count < arity) {
        const auto end = parts.part.begin() + static_cast<std::ptrdiff_t>(parts.count);
        const auto largest = std::max_element(parts.part.begin(), end, [](auto a, auto b) { return a.size() < b.size(); });
        if (largest->size() <= leaf_size) break;
        const std::span<Index> part = *largest;
        const Cut cut = plan.builder == TreeBuilder::Median ? cut_median(part, plan.items, leaf_size)
                        : plan.builder == TreeBuilder::Sah
                            ? cut_sah(part, plan.items, leaf_size)
                            : cut_middle(part, plan.items, plan.triangles, plan.positions, plan.directions, leaf_size);
        std::copy_backward(largest + 1, end, end + 1);
        *largest = part.first(cut);
        *(largest + 1) = part.subspan(cut);
        ++parts.count;
    }
    return parts;
}

} // namespace trocar::collision
