#include "base/triangle_tree.hpp"

#include "base/predicates.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>

namespace trocar {
namespace {

/// m^2; 0 inside. Called for every box that a query comes to: it must be inlined.
[[gnu::always_inline]] inline double distance_sq(const Vec3& lo, const Vec3& hi, const Vec3& p) noexcept {
    const double x = std::max(std::max(lo[0] - p[0], p[0] - hi[0]), 0.0);
    const double y = std::max(std::max(lo[1] - p[1], p[1] - hi[1]), 0.0);
    const double z = std::max(std::max(lo[2] - p[2], p[2] - hi[2]), 0.0);
    return x * x + y * y + z * z;
}

/// The same of the box of a triangle.
[[gnu::always_inline]] inline double distance_sq(const std::array<Vec3, 3>& t, const Vec3& p) noexcept {
    double sum = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        const double lo = std::min(std::min(t[0][axis], t[1][axis]), t[2][axis]), hi = std::max(std::max(t[0][axis], t[1][axis]), t[2][axis]);
        const double out = std::max(std::max(lo - p[axis], p[axis] - hi), 0.0);
        sum += out * out;
    }
    return sum;
}

/// Of a squared distance: what is farther than that is farther, whatever rounding did. Triangles that are equally near are then all compared.
constexpr double kAllEquallyNear = 1.0 + 0x1p-48;

/// A centre that can be compared: non-finite triangles go to the origin, their boxes keep them out of every query.
Vec3 sortable_centre(const Vec3& a, const Vec3& b, const Vec3& c) noexcept {
    const Vec3 sum = a + b + c;
    return is_finite(sum) ? sum : Vec3(Vec3::Zero());
}


/// Sign of orient2d(a, b, p) for p shifted by (e, e^2), e -> 0: simulation of simplicity (Edelsbrunner & Muecke 1990).
/// 0 only where a and b coincide.
int shifted_orient2d(const Point2& a, const Point2& b, const Point2& p) noexcept {
    const int sign = orient2d(a, b, p);
    if (sign != 0) return sign;
    if (a.y != b.y) return a.y > b.y ? 1 : -1;
    if (a.x != b.x) return b.x > a.x ? 1 : -1;
    return 0;
}

} // namespace

void TriangleTree::build(std::span<const Vec3> vertices, std::span<const Triangle> triangles) {
    nodes_.clear();
    ways_.assign(1, {Vec3::Zero(), Vec3::Zero()});
    parts_.clear(), part_box_.clear(), part_vertex_.clear(), fitted_.clear(), above_.clear();
    vertex_count_ = 0;
    const std::size_t count = triangles.size();
    order_.resize(count);
    std::iota(order_.begin(), order_.end(), Index{0});
    std::vector<Vec3> centres(count);
    for (std::size_t t = 0; t < count; ++t)
        centres[t] = sortable_centre(vertices[triangles[t][0]], vertices[triangles[t][1]], vertices[triangles[t][2]]);
    if (count > 0) {
        nodes_.reserve(count);
        build_node(order_, centres, 0);
    }
    triangles_.resize(count);
    for (std::size_t slot = 0; slot < count; ++slot) triangles_[slot] = triangles[order_[slot]];
    corners_.resize(count);
    refit(vertices);
}

Index TriangleTree::build_node(std::span<Index> slots, std::span<const Vec3> centres, Index first) {
    const auto id = static_cast<Index>(nodes_.size());
    nodes_.emplace_back();
    if (slots.size() <= kLeafSize) {
        std::sort(slots.begin(), slots.end());
        nodes_[id].first = first;
        nodes_[id].count = static_cast<Index>(slots.size());
        return id;
    }
    Box3 box;
    for (const Index t : slots) box.add(centres[t]);
    int axis = 0;
    box.extent().maxCoeff(&axis);
    const std::size_t half = slots.size() / 2;
    std::nth_element(slots.begin(), slots.begin() + static_cast<std::ptrdiff_t>(half), slots.end(),
                     [&](Index a, Index b) { return centres[a][axis] != centres[b][axis] ? centres[a][axis] < centres[b][axis] : a < b; });
    build_node(slots.first(half), centres, first);
    const Index right = build_node(slots.subspan(half), centres, first + static_cast<Index>(half));
    nodes_[id].first = right;
    return id;
}

void TriangleTree::find_common_vertices() {
    const auto keep_common = [](Triangle& own, const Triangle& other) {
        for (Index& v : own)
            if (v != other[0] && v != other[1] && v != other[2]) v = kNoIndex;
    };
    common_.resize(nodes_.size());
    for (std::size_t id = nodes_.size(); id-- > 0;) { // children follow their parents
        const Node& node = nodes_[id];
        const bool leaf = node.count > 0;
        common_[id] = leaf ? triangles_[node.first] : common_[id + 1];
        if (!leaf) keep_common(common_[id], common_[node.first]);
        for (Index slot = node.first + 1; leaf && slot < node.first + node.count; ++slot) keep_common(common_[id], triangles_[slot]);
    }
}

void TriangleTree::refit(std::span<const Vec3> vertices) noexcept {
    now_ = {};
    for (Box3& ways : ways_) ways = {Vec3::Zero(), Vec3::Zero()};
    if (vertices.size() == vertex_count_) // a follow may come after
        for (std::size_t k = 0; k < fitted_.size(); ++k) fitted_[k] = vertices[part_vertex_[k]];
    fit_boxes(nodes_, 0, nodes_.size(), [&](Index slot) -> const std::array<Vec3, 3>& {
        for (std::size_t k = 0; k < 3; ++k) {
            assert(triangles_[slot][k] < vertices.size());
            corners_[slot][k] = vertices[triangles_[slot][k]];
        }
        return corners_[slot];
    });
}

std::optional<SurfacePoint> TriangleTree::closest(const Vec3& p, double max_distance) const noexcept {
    if (nodes_.empty() || !is_finite(p) || !(max_distance >= 0.0)) return std::nullopt;
    struct Entry {
        Index node;
        double distance_sq;
    };
    std::array<Entry, kMaxDepth> stack;
    std::size_t size = 0;
    double best_sq = max_distance * max_distance, within_sq = best_sq * kAllEquallyNear;
    SurfacePoint best;
    const auto distance_to = [&](Index id) __attribute__((always_inline)) {
        const Box3 box = opened(nodes_[id]);
        return distance_sq(box.lo, box.hi, p);
    };
    stack[size++] = {0, distance_to(0)};
    while (size > 0) {
        const Entry entry = stack[--size];
        if (!(entry.distance_sq <= within_sq)) continue;
        const Node& node = nodes_[entry.node];
        if (node.count == 0) {
            Entry near{entry.node + 1, distance_to(entry.node + 1)}, far{node.first, distance_to(node.first)};
            if (far.distance_sq < near.distance_sq) std::swap(near, far);
            if (far.distance_sq <= within_sq) stack[size++] = far;
            if (near.distance_sq <= within_sq) stack[size++] = near;
            continue;
        }
        for (Index slot = node.first; slot < node.first + node.count; ++slot) {
            const std::array<Vec3, 3> corners = corners_at(slot);
            if (distance_sq(corners, p) > within_sq) continue; // cheaper than the triangle itself
            const PointOnTriangle hit = closest_on_triangle(p, corners[0], corners[1], corners[2]);
            const bool better = hit.distance_sq < best_sq || (hit.distance_sq == best_sq && order_[slot] < best.triangle);
            if (!better || !std::isfinite(hit.distance_sq)) continue; // a corner may not be finite
            best_sq = hit.distance_sq, within_sq = best_sq * kAllEquallyNear;
            best = {order_[slot], hit.point, hit.bary, std::sqrt(hit.distance_sq)};
        }
    }
    if (best.triangle == kNoIndex) return std::nullopt;
    return best;
}

int TriangleTree::crossing(Index slot, const Vec3& p, int axis, bool positive) const noexcept {
    const auto [a, b, c] = corners_at(slot);
    const Point2 flat = drop_axis(p, axis), fa = drop_axis(a, axis), fb = drop_axis(b, axis), fc = drop_axis(c, axis);
    const int turn = shifted_orient2d(fa, fb, flat);
    if (turn == 0 || shifted_orient2d(fb, fc, flat) != turn || shifted_orient2d(fc, fa, flat) != turn) return 0;
    // turn > 0: the front face's normal points along +axis. A p in the plane counts as just below it along the axis.
    int side = orient3d(a, b, c, p) * turn;
    if (side == 0) side = -1;
    if (positive ? side >= 0 : side <= 0) return 0;
    return positive ? turn : -turn;
}

/// May a ray from p meet what is in the box?
static bool ray_meets(const Box3& box, const Vec3& p, int axis, bool positive) noexcept {
    const int i = (axis + 1) % 3, j = (axis + 2) % 3;
    return box.lo[i] <= p[i] && p[i] <= box.hi[i] && box.lo[j] <= p[j] && p[j] <= box.hi[j] &&
           (positive ? box.hi[axis] >= p[axis] : box.lo[axis] <= p[axis]);
}

template <class Visit>
void TriangleTree::walk_ray(const Vec3& p, int axis, bool positive, Visit&& visit) const noexcept {
    if (!is_finite(p)) return;
    bool go_on = true;
    walk([&](const Box3& box) { return go_on && ray_meets(box, p, axis, positive); },
         [&](Index slot) {
             if (const int sign = crossing(slot, p, axis, positive); sign != 0) go_on = visit(sign);
         });
}

bool TriangleTree::overlaps_any(const Box3& box) const noexcept {
    bool any = false;
    walk([&](const Box3& node) { return !any && node.overlaps(box); }, [&any](Index) { any = true; });
    return any;
}

int TriangleTree::ray_crossings(const Vec3& p, int axis, bool positive) const noexcept {
    int crossings = 0;
    walk_ray(p, axis, positive, [&crossings](int sign) {
        crossings += sign;
        return true;
    });
    return crossings;
}

void TriangleTree::ray_crossings(std::span<const Vec3> points, int axis, bool positive, std::span<int> crossings) const noexcept {
    assert(points.size() <= kMaxPacket && crossings.size() == points.size());
    Box3 rays; // all of them, as far as they go
    for (const Vec3& p : points) rays.add(p);
    (positive ? rays.hi : rays.lo)[axis] = positive ? std::numeric_limits<double>::infinity() : -std::numeric_limits<double>::infinity();
    std::fill(crossings.begin(), crossings.end(), 0);
    walk([&](const Box3& box) { return box.overlaps(rays); },
         [&](Index slot) {
             const Box3 box = triangle_box(slot);
             for (std::size_t k = 0; k < points.size(); ++k)
                 if (ray_meets(box, points[k], axis, positive)) crossings[k] += crossing(slot, points[k], axis, positive);
         });
}

bool TriangleTree::ray_meets_any(const Vec3& p, int axis, bool positive) const noexcept {
    bool met = false;
    walk_ray(p, axis, positive, [&met](int) {
        met = true;
        return false;
    });
    return met;
}

} // namespace trocar
