#include "base/closest_point.hpp"

#include <algorithm>

namespace trocar {
namespace {

/// Weights of the inside region below this share of (edge^3 x reach), whose rounding error is about 1e-16 of it, are
/// uncertain: the edges are evaluated as well.
constexpr double kClearlyInside = 1e-9;

/// Keeps the nearer of what is known and of the edge from one corner to the next.
[[gnu::always_inline]] inline void keep_nearer(const Vec3& p, const Vec3& from, const Vec3& to, std::size_t corner, PointOnTriangle& best) noexcept {
    const PointOnSegment hit = closest_on_segment(p, {from, to});
    if (best.distance_sq <= hit.distance_sq) return;
    best = {hit.point, {0.0, 0.0, 0.0}, hit.distance_sq};
    best.bary[corner] = 1.0 - hit.parameter;
    best.bary[(corner + 1) % 3] = hit.parameter;
}

PointsOnSegments pair_at(const Segment& a, const Segment& b, double s, double t) noexcept {
    const Vec3 on_a = a.from + s * (a.to - a.from), on_b = b.from + t * (b.to - b.from);
    return {on_a, on_b, s, t, (on_a - on_b).squaredNorm()};
}

} // namespace

PointOnSegment closest_on_segment(const Vec3& p, const Segment& segment) noexcept {
    const Vec3 direction = segment.to - segment.from;
    const double length_sq = direction.squaredNorm();
    const double along = direction.dot(p - segment.from);
    const double t = along <= 0.0 || length_sq == 0.0 ? 0.0 : std::min(along / length_sq, 1.0);
    // the far end itself, not from + 1 * direction, which may round past it
    const Vec3 point = t < 1.0 ? Vec3(segment.from + t * direction) : segment.to;
    return {point, t, (p - point).squaredNorm()};
}

PointOnTriangle closest_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) noexcept {
    const Vec3 ab = b - a, bc = c - b, ca = a - c, ap = p - a, bp = p - b, cp = p - c;
    const Vec3 normal = ab.cross(-ca);
    const double weight_a = normal.dot(bc.cross(bp));
    const double weight_b = normal.dot(ca.cross(cp));
    const double weight_c = normal.dot(ab.cross(ap));
    const double smallest = std::min({weight_a, weight_b, weight_c});
    const double sum = weight_a + weight_b + weight_c;

    PointOnTriangle best{a, {1.0, 0.0, 0.0}, ap.squaredNorm()};
    const double edge_sq = std::max({ab.squaredNorm(), bc.squaredNorm(), ca.squaredNorm()});
    const double reach_sq = std::max(edge_sq, best.distance_sq);
    const double doubt_sq = kClearlyInside * kClearlyInside * edge_sq * edge_sq * edge_sq * reach_sq;
    const auto clearly_inside = [doubt_sq](double weight) { return weight > 0.0 && weight * weight > doubt_sq; };
    if (smallest >= 0.0 && sum > 0.0) {
        best.bary = {weight_a / sum, weight_b / sum, weight_c / sum};
        // offsets from one corner: no cancellation against a far origin
        best.point = a + best.bary[1] * ab - best.bary[2] * ca;
        best.distance_sq = (p - best.point).squaredNorm();
        if (clearly_inside(smallest)) return best;
    }
    // What is nearest lies on an edge that p is beyond: at a corner between two, it is beyond one of them.
    if (!clearly_inside(weight_c)) keep_nearer(p, a, b, 0, best);
    if (!clearly_inside(weight_a)) keep_nearer(p, b, c, 1, best);
    if (!clearly_inside(weight_b)) keep_nearer(p, c, a, 2, best);
    return best;
}

PointsOnSegments closest_on_segments(const Segment& a, const Segment& b) noexcept {
    const Vec3 da = a.to - a.from, db = b.to - b.from, r = a.from - b.from;
    PointsOnSegments best = pair_at(a, b, 0.0, closest_on_segment(a.from, b).parameter);
    const auto keep_better = [&best](const PointsOnSegments& other) {
        if (!(best.distance_sq <= other.distance_sq)) best = other;
    };
    keep_better(pair_at(a, b, 1.0, closest_on_segment(a.to, b).parameter));
    keep_better(pair_at(a, b, closest_on_segment(b.from, a).parameter, 0.0));
    keep_better(pair_at(a, b, closest_on_segment(b.to, a).parameter, 1.0));

    const double aa = da.squaredNorm(), bb = db.squaredNorm(), ab = da.dot(db);
    const double determinant = aa * bb - ab * ab; // |da x db|^2
    if (determinant <= 0.0) return best;
    const double s = (ab * db.dot(r) - bb * da.dot(r)) / determinant;
    if (!(s > 0.0 && s < 1.0)) return best;
    const double t = closest_on_segment(a.from + s * da, b).parameter;
    keep_better(pair_at(a, b, s, t));
    return best;
}

} // namespace trocar
