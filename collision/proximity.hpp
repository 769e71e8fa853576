// Which triangles are near a point at the end of the step.
#pragma once

#include "base/closest_point.hpp"
#include "collision/box_tree.hpp"

namespace seldinger::collision {

/// Calls found(triangle id, PointOnTriangle) for every triangle within radius of the point at t1, in the tree's order.
/// The tree must be refit to this motion (its swept boxes hold the end positions too).
template <class Found>
void for_each_close_triangle(const BoxTree& tree, const SurfaceMotion& motion, const Vec3& point, double radius, Found&& found) {
    if (tree.empty()) return;
    const SweptBox here = make_swept_box(point, point);
    const float reach = round_up(radius);
    // Depth of a balanced tree over 2^32 triangles, one sibling waiting per level.
    Index stack[64];
    int top = 0;
    stack[top++] = 0;
    while (top > 0) {
        const BoxTree::Node& node = tree.nodes()[stack[--top]];
        if (!are_near(node.box, here, reach)) continue;
        if (node.left != kNoIndex) {
            stack[top++] = node.left + 1;
            stack[top++] = node.left;
            continue;
        }
        const BoxTree::Range range = tree.clusters()[node.cluster].triangles;
        for (const Index id : tree.triangle_ids().subspan(range.begin, range.size())) {
            const Triangle& t = tree.topology().triangles[id];
            const PointOnTriangle on = closest_on_triangle(point, motion.t1[t[0]], motion.t1[t[1]], motion.t1[t[2]]);
            if (on.distance_sq <= radius * radius) found(id, on);
        }
    }
}

} // namespace seldinger::collision
