#include "engine/prepare/blood.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace trocar::engine {

namespace {

/// Of the radius there: how far the radius of an end is averaged, upstream or downstream of it, since inscribed spheres are smaller
/// before a closed end.
constexpr double kEndLength = 4.0;

/// m, mean radius from point `from` on, as far as `next` leads and the length of an end goes.
template <class Next>
double mean_radius(const BloodFlow& flow, Index from, Next&& next) {
    double sum = 0.0, length = 0.0, widest = 0.0;
    std::size_t count = 0;
    for (Index i = from; i != kNoIndex; i = next(i)) {
        sum += flow.radii[i];
        widest = std::max(widest, flow.radii[i]);
        ++count;
        const Index after = next(i);
        if (after == kNoIndex || length > kEndLength * widest) break;
        length += (flow.points[after] - flow.points[i]).norm();
    }
    return sum / static_cast<double>(count);
}

void list_children(BloodFlow& flow) {
    flow.child_begin.assign(flow.point_count() + 1, 0);
    for (const Index parent : flow.parents)
        if (parent != kNoIndex) ++flow.child_begin[parent + 1];
    for (std::size_t i = 0; i < flow.point_count(); ++i) flow.child_begin[i + 1] += flow.child_begin[i];
    flow.children.resize(flow.child_begin.back());
    std::vector<Index> filled(flow.child_begin.begin(), flow.child_begin.end() - 1);
    for (Index i = 0; i < flow.point_count(); ++i)
        if (flow.parents[i] != kNoIndex) flow.children[filled[flow.parents[i]]++] = i;
}

} // namespace

BloodFlow make_blood_flow(const spheretree::CentrelineTree& tree, double speed) {
    BloodFlow flow;
    flow.points = tree.points;
    flow.radii = tree.radii;
    flow.parents = tree.parents;
    list_children(flow);
    std::vector<double> rate(flow.point_count(), 0.0); // of the flow, up to a factor
    for (Index i = static_cast<Index>(flow.point_count()); i-- > 0;) {
        if (flow.children_of(i).empty()) {
            const double r = mean_radius(flow, i, [&](Index at) { return flow.parents[at]; });
            rate[i] = r * r * r;
        }
        if (flow.parents[i] != kNoIndex) rate[flow.parents[i]] += rate[i];
    }
    const double inlet = mean_radius(flow, 0, [&](Index at) {
        const auto after = flow.children_of(at);
        return after.size() == 1 ? after.front() : kNoIndex; // a fork ends it
    });
    const double scale = rate[0] > 0.0 ? speed * inlet * inlet / rate[0] : 0.0; // of rate to m^3/s over pi
    for (Index i = 0; i < flow.point_count(); ++i) {
        const double area = flow.radii[i] * flow.radii[i];
        flow.speeds.push_back(area > 0.0 ? scale * rate[i] / area : 0.0);
    }
    return flow;
}

Vec3 find_inflow(const spheretree::CentrelineTree& tree, const Vec3& direction) {
    std::vector<char> has_child(tree.point_count(), 0);
    for (Index i = 1; i < tree.point_count(); ++i) has_child[tree.parents[i]] = 1;
    Vec3 place = tree.points.front();
    double most = 0.0; // against the direction
    for (Index end = 1; end < tree.point_count(); ++end) {
        if (has_child[end]) continue;
        Index at = end; // where its branch has left the root by a radius
        while (tree.parents[at] != 0 && (tree.points[tree.parents[at]] - tree.points.front()).norm() > tree.radii.front())
            at = tree.parents[at];
        const Vec3 way = tree.points[at] - tree.points.front();
        const double back = -way.dot(direction) / std::max(way.norm(), 1e-12);
        if (back <= most) continue;
        most = back;
        place = tree.points[end];
    }
    return place;
}

Index find_flow_point(const BloodFlow& flow, const Vec3& p) noexcept { return find_flow_point(flow, p, flow.points); }

Index find_flow_point(const BloodFlow& flow, const Vec3& p, std::span<const Vec3> points) noexcept {
    Index best = 0;
    double least = std::numeric_limits<double>::infinity();
    for (Index i = 0; i < flow.point_count(); ++i) {
        const double share = (points[i] - p).squaredNorm() / (flow.radii[i] * flow.radii[i] + std::numeric_limits<double>::min());
        if (share < least) {
            least = share;
            best = i;
        }
    }
    return best;
}

} // namespace trocar::engine
