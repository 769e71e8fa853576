// Which triangles are near a point at the end of the step.
#pragma once

#include "base/closest_point.hpp"
#include "collision/bvh/dop_tree.hpp"
#include "collision/bvh/near_pairs.hpp"

namespace trocar::collision {

/// A point and a radius as the tree's bounds see them.
class PointQuery {
public:
    PointQuery(const DopTree& tree, const Vec3& point, double radius) noexcept : arity_(tree.options().arity), slabs_(tree.slabs()) {
        const Directions directions = directions_of(tree.options().dop);
        project_vertex(point, point, directions, box_.data(), box_.data() + slabs_);
        for (std::size_t s = 0; s < slabs_; ++s) reach_[s] = round_up(radius * direction_length(directions[s]));
    }
    [[nodiscard]] std::uint32_t near_children_of(const DopTree& tree, Index node) const noexcept {
        return near_children(box_.data(), 1, tree.child_bounds(node), arity_, slabs_, reach_.data());
    }
    [[nodiscard]] std::uint32_t near_features_of(const DopTree& tree, Index block) const noexcept {
        return near_features(box_.data(), tree.block_bounds(block), slabs_, reach_.data());
    }

private:
    std::size_t arity_, slabs_;
    std::array<float, 2 * kMaxSlabs> box_{};
    std::array<float, kMaxSlabs> reach_{};
};

namespace detail {

/// One subtree: recursion is as deep as the tree.
template <class Visit>
void for_each_near_face(DopTree& tree, Index at, const PointQuery& query, Visit&& visit) {
    if ((at & DopTree::kLeafBit) == 0) {
        tree.open(at);
        for (std::uint32_t near = query.near_children_of(tree, at); near != 0; near &= near - 1) {
            const Index child = tree.children(at)[static_cast<std::size_t>(__builtin_ctz(near))];
            if (child != DopTree::kNoChild) for_each_near_face(tree, child, query, visit);
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

/// Calls found(triangle id, PointOnTriangle) for every triangle within radius of the point at t1, in the tree's order.
/// The tree must be refit to a motion with these end positions (its swept bounds hold them too), or follow one.
template <class Found>
void for_each_close_triangle(DopTree& tree, const SurfaceMotion& motion, const Vec3& point, double radius, Found&& found) {
    if (tree.empty()) return;
    detail::for_each_near_face(tree, tree.root(), PointQuery(tree, point, radius), [&](Index id) {
        const Triangle& t = tree.topology().triangles[id];
        const Vec3 &a = motion.t1[t[0]], &b = motion.t1[t[1]], &c = motion.t1[t[2]];
        if (is_beyond_plane(point, a, b, c, radius)) return;
        const PointOnTriangle on = closest_on_triangle(point, a, b, c);
        if (on.distance_sq <= radius * radius) found(id, on);
    });
}

} // namespace trocar::collision
