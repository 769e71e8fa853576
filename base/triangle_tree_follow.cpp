// A box tree that follows a surface that changes little, instead of being fitted to it in every step.
#include "base/triangle_tree.hpp"

#include <algorithm>
#include <cmath>

namespace trocar {
namespace {

/// Share of what a part may be open by, from which on it is renewed before it must be: some parts in each call, so that not all of them are
/// due at once.
constexpr double kRenewFrom = 0.5;
/// One part of so many is renewed early in a call.
constexpr std::size_t kPartsPerEarlyOne = 16;
/// Of the largest coordinate: more than the rounding of a difference and of a sum.
constexpr double kWayRounding = 0x1p-50;

/// m; half of how far the ways of vertices differ along an axis: what they have in common opens no box. Infinite where they are not finite.
double opening_of(const Box3& ways) noexcept {
    const double widest = ways.extent().maxCoeff();
    return widest >= 0.0 ? 0.5 * widest : std::numeric_limits<double>::infinity();
}

} // namespace

void TriangleTree::start_following(std::span<const Vec3> vertices, double loosest) {
    std::vector<std::size_t> slots(nodes_.size()); // beneath each node
    for (std::size_t id = nodes_.size(); id-- > 0;)
        slots[id] = nodes_[id].count > 0 ? nodes_[id].count : slots[id + 1] + slots[nodes_[id].first];
    parts_.clear(), part_vertex_.clear(), above_.clear();
    std::vector<Index> last(vertices.size(), kNoIndex); // part that has the vertex
    for (std::size_t id = 0; id < nodes_.size();) {
        if (slots[id] > kPartSize) { // a leaf holds fewer
            nodes_[id].part = 0;
            above_.push_back(static_cast<Index>(id++));
            continue;
        }
        const auto own = static_cast<Index>(parts_.size());
        Part part{static_cast<Index>(id), static_cast<Index>(id), static_cast<Index>(part_vertex_.size()), 0};
        for (std::size_t left = slots[id]; left > 0; ++part.node_end) {
            Node& node = nodes_[part.node_end];
            node.part = own + 1;
            left -= node.count;
            for (Index slot = node.first; slot < node.first + node.count; ++slot)
                for (const Index v : triangles_[slot])
                    if (last[v] != own) last[v] = own, part_vertex_.push_back(v);
        }
        part.vertex_end = static_cast<Index>(part_vertex_.size());
        parts_.push_back(part);
        id = part.node_end;
    }
    std::reverse(above_.begin(), above_.end());
    ways_.assign(parts_.size() + 1, {Vec3::Zero(), Vec3::Zero()});
    part_box_.assign(parts_.size() + 1, Box3{});
    fitted_.resize(part_vertex_.size());
    vertex_count_ = vertices.size();
    next_ = 0;
    refit(vertices);
    double extents = 0.0;
    for (Index slot = 0; slot < order_.size(); ++slot) extents += triangle_box(slot).extent().maxCoeff();
    loosest_ = order_.empty() || !std::isfinite(extents) ? 0.0 : loosest * extents / static_cast<double>(order_.size());
}

void TriangleTree::look_at(const Part& part, Box3& ways, Box3& box) const noexcept {
    constexpr double kFar = std::numeric_limits<double>::infinity();
    Vec3 bad = Vec3::Zero(), least = Vec3::Constant(kFar), most = -least, low = least, high = most; // locals stay in registers
    for (Index k = part.vertex_begin; k < part.vertex_end; ++k) {
        const Vec3& to = now_[part_vertex_[k]];
        for (int axis = 0; axis < 3; ++axis) { // as Box3::add, without branches
            const double at = to[axis], way = at - fitted_[k][axis];
            bad[axis] += 0.0 * way; // NaN from then on, of what is not finite
            least[axis] = way < least[axis] ? way : least[axis];
            most[axis] = way > most[axis] ? way : most[axis];
            low[axis] = at < low[axis] ? at : low[axis];
            high[axis] = at > high[axis] ? at : high[axis];
        }
    }
    ways = {least, most};
    box = {low, high};
    const double largest = std::max({box.lo.cwiseAbs().maxCoeff(), box.hi.cwiseAbs().maxCoeff(), ways.lo.cwiseAbs().maxCoeff(), ways.hi.cwiseAbs().maxCoeff()});
    ways.inflate(bad == Vec3::Zero() ? kWayRounding * largest : std::numeric_limits<double>::infinity());
}

void TriangleTree::renew(const Part& part, Box3& ways) noexcept {
    for (Index k = part.vertex_begin; k < part.vertex_end; ++k) fitted_[k] = now_[part_vertex_[k]];
    fit_boxes(nodes_, part.node_begin, part.node_end, [&](Index slot) { return corners_at(slot); });
    ways = {Vec3::Zero(), Vec3::Zero()};
}

void TriangleTree::find_ways(std::span<const Vec3> vertices) noexcept {
    now_ = vertices;
    for (std::size_t k = 0; k < parts_.size(); ++k) look_at(parts_[k], ways_[k + 1], part_box_[k + 1]);
    for (const Index id : above_) {
        nodes_[id].box = box_now(id + 1);
        nodes_[id].box.add(box_now(nodes_[id].first));
    }
}

/// Some of those that will be due before long.
void TriangleTree::renew_early() noexcept {
    std::size_t left = parts_.size() / kPartsPerEarlyOne + 1;
    for (std::size_t tried = 0; tried < parts_.size() && left > 0; ++tried) {
        const std::size_t k = (next_ + tried) % parts_.size();
        if (!(opening_of(ways_[k + 1]) > kRenewFrom * loosest_)) continue;
        renew(parts_[k], ways_[k + 1]);
        --left;
        next_ = k + 1;
    }
}

void TriangleTree::renew_within(const Box3& box) noexcept {
    if (now_.empty()) return;
    for (std::size_t k = 0; k < parts_.size(); ++k) // not <=: where a vertex is not finite, boxes without it, as refit makes them
        if (!(opening_of(ways_[k + 1]) <= loosest_) && part_box_[k + 1].overlaps(box)) renew(parts_[k], ways_[k + 1]);
}

void TriangleTree::follow_loosely(std::span<const Vec3> vertices) noexcept {
    if (vertices.size() != vertex_count_ || vertices.empty()) return refit(vertices); // start_following() was not called
    find_ways(vertices);
    renew_early();
}

void TriangleTree::follow(std::span<const Vec3> vertices) noexcept {
    follow_loosely(vertices);
    for (std::size_t k = 0; k < parts_.size() && !now_.empty(); ++k)
        if (!(opening_of(ways_[k + 1]) <= loosest_)) renew(parts_[k], ways_[k + 1]);
}

} // namespace trocar
