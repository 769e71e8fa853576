// Which triangles are near a point at the end of the step.
#pragma once

#include "base/closest_point.hpp"
#include "collision/bvh/dop_tree.hpp"
#include "collision/bvh/near_pairs.hpp"

#include <algorithm>
#include <type_traits>
#include <utility>

namespace trocar::collision {

/// A point and a radius as the tree's bounds see them.
class PointQuery {
public:
    PointQuery(const DopTree& tree, const Vec3& point, double radius) noexcept : arity_(tree.options().arity), slabs_(tree.slabs()) {
        const Directions directions = directions_of(tree.options().dop);
        project_vertex(point, point, directions, box_.data(), box_.data() + slabs_);
        reach(tree, radius);
    }
    void reach(const DopTree& tree, double radius) noexcept {
        const float most = round_up(radius);
        radius_sq_ = most * most * (1.0f + 0x1p-20f); // with room for the distance's own rounding
        const Directions directions = directions_of(tree.options().dop);
        for (std::size_t s = 0; s < slabs_; ++s) reach_[s] = round_up(radius * direction_length(directions[s]));
    }
    [[nodiscard]] bool is_beyond(float distance_sq) const noexcept { return distance_sq > radius_sq_; }
    [[nodiscard]] std::uint32_t near_children_of(const DopTree& tree, Index node) const noexcept {
        return near_children(box_.data(), 1, tree.child_bounds(node), arity_, slabs_, reach_.data());
    }
    /// m^2, of a child's bounds along the axes: it is no nearer.
    [[nodiscard]] float distance_sq_to(const DopTree& tree, Index node, std::size_t child) const noexcept {
        const float* bounds = tree.child_bounds(node) + child;
        float sum = 0.0f;
        for (std::size_t s = 0; s < 3; ++s) {
            const float above = box_[s] + bounds[(s + slabs_) * arity_], below = box_[s + slabs_] + bounds[s * arity_];
            const float apart = std::max({above, below, 0.0f});
            sum += apart * apart;
        }
        return sum;
    }
    [[nodiscard]] std::uint32_t near_features_of(const DopTree& tree, Index block) const noexcept {
        return near_features(box_.data(), tree.block_bounds(block), slabs_, reach_.data());
    }

private:
    std::size_t arity_, slabs_;
    std::array<float, 2 * kMaxSlabs> box_{};
    std::array<float, kMaxSlabs> reach_{};
    float radius_sq_ = 0.0f;
};

namespace detail {

inline constexpr std::size_t kMostChildren = 8;

/// One subtree: recursion is as deep as the tree.
/// nearest_first  children in the order of their distance, for a query whose reach shrinks; else in the tree's
template <bool nearest_first, class Visit>
void for_each_near_face(DopTree& tree, Index at, const PointQuery& query, Visit&& visit) {
    if ((at & DopTree::kLeafBit) == 0) {
        tree.open(at);
        std::uint32_t near = query.near_children_of(tree, at);
        if constexpr (nearest_first) {
            std::array<std::pair<float, Index>, kMostChildren> order;
            std::size_t count = 0;
            for (; near != 0; near &= near - 1) {
                const auto child = static_cast<Index>(__builtin_ctz(near));
                if (tree.children(at)[child] == DopTree::kNoChild) continue;
                const std::pair entry(query.distance_sq_to(tree, at, child), child);
                std::size_t k = count++;
                for (; k > 0 && entry < order[k - 1]; --k) order[k] = order[k - 1];
                order[k] = entry;
            }
            for (std::size_t k = 0; k < count; ++k)
                if (!query.is_beyond(order[k].first)) for_each_near_face<true>(tree, tree.children(at)[order[k].second], query, visit);
            return;
        }
        for (; near != 0; near &= near - 1) {
            const Index child = tree.children(at)[static_cast<std::size_t>(__builtin_ctz(near))];
            if (child != DopTree::kNoChild) for_each_near_face<false>(tree, child, query, visit);
        }
        return;
    }
    const Index cluster = at & ~DopTree::kLeafBit;
    tree.make_fresh(cluster);
    if (!tree.blocks_are_fresh(cluster)) tree.refit_blocks(cluster);
    const DopTree::BlockRange& faces = tree.clusters()[cluster].faces;
    for (Index block = faces.begin; block < faces.end; ++block)
        for (std::uint32_t near = query.near_features_of(tree, block); near != 0; near &= near - 1)
            if (const Index id = tree.block_ids(block)[__builtin_ctz(near)]; id != kNoIndex) visit(id);
}

} // namespace detail

/// The radius shrinks in steps of this factor at least: bounds are compared with what it was.
inline constexpr double kShrink = 0.95;

/// Calls found(triangle id, PointOnTriangle) for every triangle within radius of the point at t1, in the tree's order; about nearest first where
/// the radius shrinks.
/// The tree must be refit to a motion with these end positions (its swept bounds hold them too), or follow one.
/// found  returns the radius from then on, if it returns anything: what is farther away may be left out
template <class Found>
void for_each_close_triangle(DopTree& tree, const SurfaceMotion& motion, const Vec3& point, double radius, Found&& found) {
    if (tree.empty()) return;
    PointQuery query(tree, point, radius);
    constexpr bool kShrinks = !std::is_void_v<decltype(found(Index{}, PointOnTriangle{}))>;
    detail::for_each_near_face<kShrinks>(tree, tree.root(), query, [&](Index id) {
        const Triangle& t = tree.topology().triangles[id];
        const Vec3 &a = motion.t1[t[0]], &b = motion.t1[t[1]], &c = motion.t1[t[2]];
        if (is_beyond_plane(point, a, b, c, radius)) return;
        const PointOnTriangle on = closest_on_triangle(point, a, b, c);
        if (!(on.distance_sq <= radius * radius)) return;
        if constexpr (!kShrinks)
            found(id, on);
        else if (const double left = found(id, on); left < kShrink * radius)
            query.reach(tree, radius = left);
    });
}

} // namespace trocar::collision
