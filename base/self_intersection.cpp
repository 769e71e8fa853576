#include "base/self_intersection.hpp"

#include "base/predicates.hpp"
#include "base/triangle_tree.hpp"

#include <algorithm>

namespace trocar {
namespace {

using Corners = std::array<Vec3, 3>;


bool in_between(double a, double x, double b) noexcept { return std::min(a, b) <= x && x <= std::max(a, b); }

/// Closed segments in the plane, points included.
bool segments_meet(const Point2& p, const Point2& q, const Point2& a, const Point2& b) noexcept {
    const int pa = orient2d(p, q, a), pb = orient2d(p, q, b), ap = orient2d(a, b, p), aq = orient2d(a, b, q);
    if (pa * pb < 0 && ap * aq < 0) return true;
    const auto on = [](int turn, const Point2& u, const Point2& v, const Point2& x) {
        return turn == 0 && in_between(u.x, x.x, v.x) && in_between(u.y, x.y, v.y);
    };
    return on(pa, p, q, a) || on(pb, p, q, b) || on(ap, a, b, p) || on(aq, a, b, q);
}

bool triangle_holds(const std::array<Point2, 3>& t, const Point2& p) noexcept {
    const int ab = orient2d(t[0], t[1], p), bc = orient2d(t[1], t[2], p), ca = orient2d(t[2], t[0], p);
    if (orient2d(t[0], t[1], t[2]) == 0) return false; // a segment: its edges are tested
    return (ab >= 0 && bc >= 0 && ca >= 0) || (ab <= 0 && bc <= 0 && ca <= 0);
}

/// A segment and a triangle in one plane meet exactly if all three projections along the axes do: at least one of them is
/// one to one, and the others cannot separate what meets.
bool coplanar_intersect(const Vec3& p, const Vec3& q, const Corners& t) noexcept {
    for (int axis = 0; axis < 3; ++axis) {
        const Point2 fp = drop_axis(p, axis), fq = drop_axis(q, axis);
        const std::array<Point2, 3> flat{drop_axis(t[0], axis), drop_axis(t[1], axis), drop_axis(t[2], axis)};
        if (!triangle_holds(flat, fp) && !segments_meet(fp, fq, flat[0], flat[1]) && !segments_meet(fp, fq, flat[1], flat[2]) &&
            !segments_meet(fp, fq, flat[2], flat[0]))
            return false;
    }
    return true;
}

/// Edge pq against triangle abc.
bool edge_crosses(const Vec3& p, const Vec3& q, const Corners& t, Crossing crossing) noexcept {
    const auto& [a, b, c] = t;
    const int side_p = orient3d(a, b, c, p), side_q = orient3d(a, b, c, q);
    const bool touching = crossing == Crossing::Touching;
    if (touching && side_p == 0 && side_q == 0) {
        // a triangle without area lies in many planes: all its edges must share one with pq
        const bool one_plane = orient3d(a, b, p, q) == 0 && orient3d(b, c, p, q) == 0 && orient3d(c, a, p, q) == 0;
        return (one_plane || !are_collinear(a, b, c)) && coplanar_intersect(p, q, t);
    }
    if (touching ? side_p * side_q > 0 : side_p * side_q >= 0) return false;
    const int ab = orient3d(p, q, a, b), bc = orient3d(p, q, b, c), ca = orient3d(p, q, c, a);
    if (touching) return (ab >= 0 && bc >= 0 && ca >= 0) || (ab <= 0 && bc <= 0 && ca <= 0);
    return ab != 0 && ab == bc && bc == ca;
}

bool all_on_one_side(const Corners& plane, const Corners& points, Crossing crossing) noexcept {
    int least = 1, most = -1;
    for (const Vec3& p : points) {
        const int side = orient3d(plane[0], plane[1], plane[2], p);
        least = std::min(least, side);
        most = std::max(most, side);
    }
    return crossing == Crossing::Touching ? least > 0 || most < 0 : least >= 0 || most <= 0;
}

} // namespace

bool segment_pierces(const Vec3& p, const Vec3& q, const std::array<Vec3, 3>& triangle) noexcept {
    return edge_crosses(p, q, triangle, Crossing::Proper);
}

bool triangles_cross(const Corners& a, const Corners& b, Crossing crossing) noexcept {
    for (const Corners* t : {&a, &b})
        for (const Vec3& corner : *t)
            if (!is_finite(corner)) return false;
    if (all_on_one_side(a, b, crossing) || all_on_one_side(b, a, crossing)) return false;
    for (std::size_t k = 0; k < 3; ++k)
        if (edge_crosses(a[k], a[(k + 1) % 3], b, crossing) || edge_crosses(b[k], b[(k + 1) % 3], a, crossing)) return true;
    return false;
}

SelfIntersections find_self_intersections(const TriMesh& mesh, std::size_t max_pairs, Crossing crossing, std::size_t max_compared) {
    SelfIntersections found;
    TriangleTree tree(mesh);
    tree.find_common_vertices();
    const auto corners = [&mesh](const Triangle& t) { return Corners{mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]}; };
    std::vector<Index> partners;
    std::size_t compared = 0;
    for (Index t = 0; t < mesh.triangles.size(); ++t) {
        const Corners own = corners(mesh.triangles[t]);
        Box3 box;
        for (const Vec3& corner : own) box.add(corner);
        partners.clear();
        tree.for_each_overlapping_apart(box, mesh.triangles[t], [&](Index other) {
            if (++compared <= max_compared && other > t && triangles_cross(own, corners(mesh.triangles[other]), crossing))
                partners.push_back(other);
        });
        std::sort(partners.begin(), partners.end());
        found.count += partners.size();
        for (const Index other : partners)
            if (found.pairs.size() < max_pairs) found.pairs.push_back({t, other});
        found.complete = compared <= max_compared;
        if (!found.complete) break;
    }
    return found;
}

} // namespace trocar
