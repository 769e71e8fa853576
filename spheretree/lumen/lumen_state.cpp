#include "spheretree/lumen/lumen_state.hpp"

#include "base/closest_point.hpp"
#include "spheretree/bounding.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

namespace trocar::spheretree {

namespace {

/// A linked triangle is tested in about the time of a sphere test with its share of the tree walk.
constexpr std::uint64_t kTrianglesPerTest = 1;
constexpr double kUnknown = std::numeric_limits<double>::infinity(); // a radius that was not measured

struct NearestWall {
    double distance_sq = std::numeric_limits<double>::infinity();
    Index triangle = kNoIndex;
    PointOnTriangle hit{};
};

/// Nearest of the linked triangles that is nearer than start_sq. No point of a triangle is nearer to p than
/// sqrt(m^2 - e^2/3), m its nearest corner and e its longest edge: most triangles need no more than that.
NearestWall find_nearest(const LumenTree& lumen, std::span<const Index> linked, std::span<const Vec3> vertices, const Vec3& p,
                         double start_sq) noexcept {
    NearestWall best{start_sq, kNoIndex, {}};
    for (const Index t : linked) {
        const Triangle& v = lumen.triangles[t];
        const Vec3 &a = vertices[v[0]], &b = vertices[v[1]], &c = vertices[v[2]];
        const double corner_sq = std::min({(a - p).squaredNorm(), (b - p).squaredNorm(), (c - p).squaredNorm()});
        const double edge_sq = std::max({(a - b).squaredNorm(), (b - c).squaredNorm(), (c - a).squaredNorm()});
        if (corner_sq - edge_sq / 3.0 >= best.distance_sq) continue;
        const PointOnTriangle hit = closest_on_triangle(p, a, b, c);
        if (hit.distance_sq < best.distance_sq) best = {hit.distance_sq, t, hit};
    }
    return best;
}

/// Sign of p's distance from a triangle's plane: positive in front, outside the lumen.
bool is_behind(const LumenTree& lumen, Index triangle, std::span<const Vec3> vertices, const Vec3& p) noexcept {
    const Triangle& v = lumen.triangles[triangle];
    const Vec3 normal = (vertices[v[1]] - vertices[v[0]]).cross(vertices[v[2]] - vertices[v[0]]);
    return (p - vertices[v[0]]).dot(normal) > 0.0;
}

/// Squared distance that a triangle keeps at least: its plane's, or what its corners and longest edge allow.
double bound_distance_sq(const Vec3& a, const Vec3& b, const Vec3& c) noexcept { // seen from the origin
    const Vec3 ab = b - a, ac = c - a;
    const Vec3 normal = ab.cross(ac);
    const double edge_sq = std::max({ab.squaredNorm(), ac.squaredNorm(), (c - b).squaredNorm()});
    const double corner_sq = std::min({a.squaredNorm(), b.squaredNorm(), c.squaredNorm()}) - edge_sq / 3.0;
    const double height = normal.dot(a), area_sq = normal.squaredNorm();
    return area_sq > 0.0 ? std::max(corner_sq, height * height / area_sq) : corner_sq;
}

/// Clearance around a moved centre, at most `cap` and at most 1 % less than there is; empty once the centre has come to
/// lie behind its wall. In a round vessel every triangle of the ring is nearly the nearest: a bound is taken for the
/// distance where it is good enough, which saves nearly all exact distances.
double free_radius(const LumenTree& lumen, Index ball, const Vec3& centre, std::span<const Vec3> vertices, double cap) noexcept {
    constexpr double kGoodEnough = 0.99 * 0.99;
    double exact_sq = cap * cap, found_sq = exact_sq;
    Index nearest = kNoIndex;
    for (const Index t : lumen.wall_of(ball)) {
        const Triangle& v = lumen.triangles[t];
        const Vec3 a = vertices[v[0]] - centre, b = vertices[v[1]] - centre, c = vertices[v[2]] - centre;
        double distance_sq = bound_distance_sq(a, b, c) * (1.0 - 1e-9);
        if (distance_sq >= found_sq) continue;
        if (distance_sq < kGoodEnough * exact_sq) {
            distance_sq = closest_on_triangle(Vec3::Zero(), a, b, c).distance_sq;
            exact_sq = std::min(exact_sq, distance_sq);
            if (distance_sq >= found_sq) continue;
        }
        found_sq = distance_sq;
        nearest = t;
    }
    if (nearest != kNoIndex && is_behind(lumen, nearest, vertices, centre)) {
        const NearestWall exact = find_nearest(lumen, lumen.wall_of(ball), vertices, centre, cap * cap);
        if (exact.triangle != kNoIndex && is_behind(lumen, exact.triangle, vertices, centre)) return -1.0;
    }
    return std::sqrt(std::max(found_sq, 0.0)) * (1.0 - 1e-12);
}

} // namespace

void LumenState::mark_still(const LumenTree& lumen, std::span<const double> motion_weight) {
    still_.assign(lumen.ball_count(), 1);
    for (Index b = 0; b < lumen.ball_count(); ++b)
        for (const Index t : lumen.wall_of(b))
            for (const Index v : lumen.triangles[t])
                if (motion_weight[v] != 0.0) still_[b] = 0;
    list_moving(lumen);
    all_bounds_fit_ = false;
}

void LumenState::rest(const LumenTree& lumen) {
    for (Index b = 0; b < lumen.ball_count(); ++b) {
        const Sphere& ball = lumen.ball(b);
        balls_[b] = {ball.centre, ball.centre, ball.radius, ball.radius, ball.radius};
        stamp_[b] = step_;
    }
    bounds_ = lumen.tree.spheres;
    largest_ = lumen.largest_ball;
    all_bounds_fit_ = false;
}

void LumenState::size_for(const LumenTree& lumen) {
    balls_.resize(lumen.ball_count());
    swept_.resize(lumen.ball_count());
    stamp_.assign(lumen.ball_count(), 0);
    step_ = 0;
    list_moving(lumen);
}

void LumenState::list_moving(const LumenTree& lumen) {
    moving_.clear();
    moving_bounds_.clear();
    const auto moves = [&](Index b) { return still_.empty() || !still_[b]; };
    for (Index b = 0; b < lumen.ball_count(); ++b)
        if (moves(b)) moving_.push_back(b);
    for (Index s = 0; s < lumen.tree.sphere_count(); ++s) {
        const auto next = std::lower_bound(moving_.begin(), moving_.end(), lumen.tree.item_begin[s]);
        if (next != moving_.end() && *next < lumen.tree.item_end[s]) moving_bounds_.push_back(s);
    }
}

void LumenState::update(const LumenTree& lumen, std::span<const Vec3> vertices_t0, std::span<const Vec3> vertices_t1, bool continues) {
    const bool fresh = balls_.size() != lumen.ball_count();
    if (fresh) size_for(lumen);
    balls_updated_ = 0;
    vertices_t0_ = vertices_t0;
    vertices_t1_ = vertices_t1;
    const bool resting = vertices_t0.empty() && vertices_t1.empty();
    if (resting && at_rest_ && !fresh) return;
    ++step_;
    if (fresh || resting) rest(lumen);
    continues = continues && !fresh && !at_rest_;
    at_rest_ = resting;
    if (resting) return;
    move_centres(lumen, continues);
    move_bounds(lumen);
}

std::vector<KeptBall> LumenState::kept() const {
    std::vector<KeptBall> kept;
    if (at_rest_) return kept;
    for (std::size_t b = 0; b < balls_.size(); ++b) kept.push_back({balls_[b].centre_t1, balls_[b].radius_t1, is_known(b)});
    return kept;
}

void LumenState::keep(const LumenTree& lumen, std::span<const KeptBall> kept) {
    size_for(lumen);
    ++step_;
    rest(lumen); // balls that stand still stay like this
    at_rest_ = false;
    for (Index b = 0; b < kept.size(); ++b) {
        if (!still_.empty() && still_[b]) continue;
        balls_[b].centre_t1 = kept[b].centre;
        balls_[b].radius_t1 = kept[b].radius;
        stamp_[b] = kept[b].measured ? step_ : step_ - 1;
    }
}

void LumenState::move_centres(const LumenTree& lumen, bool continues) {
    const auto moved = [&](Index b, std::span<const Vec3> vertices) {
        Vec3 shift = Vec3::Zero();
        for (Index k = lumen.anchor_begin[b]; k < lumen.anchor_begin[b + 1]; ++k)
            shift += lumen.anchor_weights[k] * (vertices[lumen.anchors[k]] - lumen.rest_vertices[lumen.anchors[k]]);
        return Vec3(lumen.ball(b).centre + shift);
    };
    for (const Index b : moving_) {
        MovingBall& ball = balls_[b];
        const Vec3 last = ball.centre_t1;
        ball.centre_t0 = continues ? last : moved(b, vertices_t0_);
        ball.centre_t1 = moved(b, vertices_t1_);
        // The step begins where the last one ended: what was measured then still holds.
        ball.radius_t0 = stamp_[b] + 1 == step_ && last == ball.centre_t0 ? ball.radius_t1 : kUnknown;
        const double cap = lumen.ball(b).radius * (1.0 + 0.5 * lumen.link_reach);
        swept_[b] = {0.5 * (ball.centre_t0 + ball.centre_t1), (cap + 0.5 * (ball.centre_t1 - ball.centre_t0).norm()) * kRoundOut};
        stamp_[b] = step_ - 1; // its radius is not known yet
    }
}

/// Inner bounds keep their rest centre relative to the balls beneath, and hold both ends of every one of them.
void LumenState::move_bound(const LumenTree& lumen, Index s) {
    const SphereTree& tree = lumen.tree;
    const auto beneath = std::span<const Sphere>(swept_).subspan(tree.item_begin[s], tree.item_end[s] - tree.item_begin[s]);
    if (tree.is_leaf(s)) {
        bounds_[s] = beneath.front();
    } else {
        Vec3 shift = Vec3::Zero();
        for (Index b = tree.item_begin[s]; b < tree.item_end[s]; ++b) shift += swept_[b].centre - lumen.ball(b).centre;
        const Vec3 centre = tree.spheres[s].centre + shift / static_cast<double>(beneath.size());
        bounds_[s] = {centre, enclosing_radius(centre, beneath)};
    }
    double largest = 0.0;
    for (const Sphere& ball : beneath) largest = std::max(largest, ball.radius);
    largest_[s] = largest;
}

void LumenState::move_bounds(const LumenTree& lumen) {
    if (!all_bounds_fit_) {
        for (Index b = 0; b < still_.size(); ++b) {
            if (!still_[b]) continue;
            swept_[b] = lumen.ball(b);
            stamp_[b] = kAlways;
        }
        for (Index s = 0; s < lumen.tree.sphere_count(); ++s) move_bound(lumen, s);
    } else {
        for (const Index s : moving_bounds_) move_bound(lumen, s);
    }
    all_bounds_fit_ = true;
}

const MovingBall& LumenState::ball(const LumenTree& lumen, Index ball) {
    MovingBall& b = balls_[ball];
    if (is_known(ball)) return b;
    stamp_[ball] = step_;
    ++balls_updated_;
    const double cap = lumen.ball(ball).radius * (1.0 + 0.5 * lumen.link_reach);
    if (b.radius_t0 == kUnknown) b.radius_t0 = free_radius(lumen, ball, b.centre_t0, vertices_t0_, cap);
    b.radius_t1 = free_radius(lumen, ball, b.centre_t1, vertices_t1_, cap);
    b.radius = std::min(b.radius_t0, b.radius_t1);
    return b;
}

std::uint64_t LumenState::cost_of(const LumenTree& lumen, Index ball) const noexcept {
    if (is_known(ball)) return 0;
    return (balls_[ball].radius_t0 == kUnknown ? 2 : 1) * (1 + lumen.wall_of(ball).size() / kTrianglesPerTest);
}

WallPoint find_wall_point(const LumenTree& lumen, std::span<const Vec3> vertices, Index ball, const Vec3& p) noexcept {
    const std::span<const Vec3> now = vertices.empty() ? std::span<const Vec3>(lumen.rest_vertices) : vertices;
    const NearestWall nearest = find_nearest(lumen, lumen.wall_of(ball), now, p, std::numeric_limits<double>::infinity());
    if (nearest.triangle == kNoIndex) return {};
    return {nearest.triangle, nearest.hit.point, nearest.hit.bary, std::sqrt(nearest.distance_sq)};
}

} // namespace trocar::spheretree
