#include "engine/viewer/lumen_places.hpp"

#include "engine/prepare/geometry_cache.hpp"

#include <algorithm>
#include <limits>

namespace trocar::engine::viewer {

namespace {

using spheretree::CentrelineTree;
using spheretree::Sphere;

/// Of the widest place within so many radii behind it: a tip that is narrower runs into the corner of a cap.
constexpr double kFullWidth = 0.9, kCornerReach = 3.0;
/// Radii of the fork that it leaves: a branch that ends nearer to it is a dent of the wall.
constexpr double kStub = 1.2;
/// Radii of an end: a place that is nearer along the centreline is the end.
constexpr double kAtEnd = 2.0;
/// Radii over which the direction of a centreline is measured.
constexpr double kDirectionReach = 2.0;
/// m; steps of a walk straight ahead.
constexpr double kStep = 2.5e-4;

std::vector<std::size_t> count_children(const CentrelineTree& tree) {
    std::vector<std::size_t> count(tree.point_count(), 0);
    for (const Index parent : tree.parents)
        if (parent != kNoIndex) ++count[parent];
    return count;
}

/// The tree without some points, whose children are among them.
CentrelineTree without(const CentrelineTree& tree, const std::vector<bool>& dropped) {
    CentrelineTree kept;
    std::vector<Index> number(tree.point_count(), kNoIndex);
    for (Index i = 0; i < tree.point_count(); ++i) {
        if (dropped[i]) continue;
        number[i] = static_cast<Index>(kept.point_count());
        kept.points.push_back(tree.points[i]);
        kept.radii.push_back(tree.radii[i]);
        kept.parents.push_back(tree.parents[i] == kNoIndex ? kNoIndex : number[tree.parents[i]]);
    }
    return kept;
}

} // namespace

Result<LumenPlaces> LumenPlaces::make(const spheretree::LumenTree& lumen, const Vec3& root) {
    Result<CentrelineTree> centreline = make_or_read_centreline(lumen, root);
    if (!centreline.ok()) return centreline.error();
    LumenPlaces places(lumen);
    places.wall_.build(lumen.rest_vertices, lumen.triangles);
    places.centreline_ = std::move(*centreline);
    for (Index i = 0; i < places.centreline_.point_count(); ++i) places.centreline_.radii[i] = places.clearance_at(places.centreline_.points[i]);
    places.trim_corners();
    places.drop_stubs();
    places.find_neighbours();
    return places;
}

double LumenPlaces::clearance_at(const Vec3& p) const noexcept {
    const auto wall = wall_.closest(p);
    return wall ? wall->distance : 0.0;
}

/// From each tip back to where the branch has its width, the fork that it leaves at most.
void LumenPlaces::trim_corners() {
    const std::vector<std::size_t> children = count_children(centreline_);
    const auto& [points, radii, parents] = centreline_;
    std::vector<bool> dropped(centreline_.point_count(), false);
    for (Index tip = 1; tip < centreline_.point_count(); ++tip) {
        if (children[tip] > 0) continue;
        double widest = radii[tip], along = 0.0;
        for (Index p = tip; parents[p] != kNoIndex && children[parents[p]] == 1 && along < kCornerReach * widest; p = parents[p]) {
            along += (points[p] - points[parents[p]]).norm();
            widest = std::max(widest, radii[parents[p]]);
        }
        for (Index p = tip; parents[p] != kNoIndex && children[p] <= 1 && radii[p] < kFullWidth * widest; p = parents[p]) dropped[p] = true;
    }
    centreline_ = without(centreline_, dropped);
}

/// Until every branch is longer; those that a fork loses all of end at it.
void LumenPlaces::drop_stubs() {
    for (std::size_t before = 0; before != centreline_.point_count();) {
        before = centreline_.point_count();
        const std::vector<std::size_t> children = count_children(centreline_);
        const auto& [points, radii, parents] = centreline_;
        std::vector<bool> dropped(before, false);
        for (Index tip = 1; tip < before; ++tip) {
            if (children[tip] > 0) continue;
            Index fork = parents[tip];
            while (children[fork] == 1 && parents[fork] != kNoIndex) fork = parents[fork];
            if (children[fork] == 1 || (points[tip] - points[fork]).norm() > kStub * radii[fork]) continue;
            for (Index p = tip; p != fork; p = parents[p]) dropped[p] = true;
        }
        centreline_ = without(centreline_, dropped);
    }
}

void LumenPlaces::find_neighbours() {
    neighbours_.assign(centreline_.point_count(), {});
    for (Index i = 0; i < centreline_.point_count(); ++i)
        if (const Index parent = centreline_.parents[i]; parent != kNoIndex) {
            neighbours_[i].push_back(parent);
            neighbours_[parent].push_back(i);
        }
    for (Index i = 0; i < centreline_.point_count(); ++i)
        if (neighbours_[i].size() == 1) ends_.push_back(i);
}

/// Of the spheres on the inner side of the wall there, the one whose surface comes nearest to the point.
Index LumenPlaces::find_touching_ball(const WallPoint& wall) const {
    const auto& [a, b, c] = lumen_->triangles[wall.triangle];
    const std::vector<Vec3>& at = lumen_->rest_vertices;
    const Vec3 outward = (at[b] - at[a]).cross(at[c] - at[a]);
    Index touching = 0;
    double least = std::numeric_limits<double>::infinity();
    for (Index ball = 0; ball < lumen_->ball_count(); ++ball) {
        const Vec3 in = lumen_->ball(ball).centre - wall.point;
        const double gap = in.norm() - lumen_->ball(ball).radius;
        if (in.dot(outward) > 0.0 || gap >= least) continue;
        least = gap;
        touching = ball;
    }
    return touching;
}

/// The largest of those that hold the ball's centre; the ball where none is larger.
Index LumenPlaces::find_deeper_ball(Index ball) const {
    Index deeper = ball;
    for (const Index next : lumen_->neighbours_of(ball)) {
        const Sphere& sphere = lumen_->ball(next);
        if ((sphere.centre - lumen_->ball(ball).centre).norm() < sphere.radius && sphere.radius > lumen_->ball(deeper).radius) deeper = next;
    }
    return deeper;
}

/// Of the centreline's points whose inscribed sphere holds p, the one nearest to `near`.
std::optional<Index> LumenPlaces::find_point_around(const Vec3& p, const Vec3& near) const {
    std::optional<Index> best;
    for (Index i = 0; i < centreline_.point_count(); ++i) {
        const Vec3& point = centreline_.points[i];
        if ((point - p).norm() >= centreline_.radii[i]) continue;
        if (!best || (point - near).squaredNorm() < (centreline_.points[*best] - near).squaredNorm()) best = i;
    }
    return best;
}

Index LumenPlaces::find_nearest_point(const Vec3& p) const {
    const auto nearer = [&](const Vec3& a, const Vec3& b) { return (a - p).squaredNorm() < (b - p).squaredNorm(); };
    return static_cast<Index>(std::min_element(centreline_.points.begin(), centreline_.points.end(), nearer) - centreline_.points.begin());
}

MiddlePlace LumenPlaces::middle_at(const WallPoint& wall) const {
    Index ball = find_touching_ball(wall);
    for (;;) {
        const Vec3& centre = lumen_->ball(ball).centre;
        if (const auto point = find_point_around(centre, wall.point)) return {centreline_.points[*point], centreline_.radii[*point]};
        const Index deeper = find_deeper_ball(ball);
        if (deeper == ball) return {centre, clearance_at(centre)};
        ball = deeper;
    }
}

LumenPlaces::Ways LumenPlaces::find_ways(Index from) const {
    Ways ways{std::vector<double>(centreline_.point_count(), 0.0), std::vector<Index>(centreline_.point_count(), kNoIndex)};
    std::vector<Index> open{from};
    while (!open.empty()) {
        const Index at = open.back();
        open.pop_back();
        for (const Index next : neighbours_[at]) {
            if (next == ways.before[at]) continue;
            ways.length[next] = ways.length[at] + (centreline_.points[next] - centreline_.points[at]).norm();
            ways.before[next] = at;
            open.push_back(next);
        }
    }
    return ways;
}

/// The nearest end along the centreline where that is near; else the point.
Index LumenPlaces::find_end_near(Index point) const {
    const Ways ways = find_ways(point);
    const auto nearer = [&](Index a, Index b) { return ways.length[a] < ways.length[b]; };
    const Index end = *std::min_element(ends_.begin(), ends_.end(), nearer);
    return ways.length[end] <= kAtEnd * centreline_.radii[end] ? end : point;
}

/// Towards the point that is farthest along the centreline.
Vec3 LumenPlaces::direction_from(Index point) const {
    const Ways ways = find_ways(point);
    auto ahead = static_cast<Index>(std::max_element(ways.length.begin(), ways.length.end()) - ways.length.begin());
    while (ways.before[ahead] != point && ways.length[ways.before[ahead]] >= kDirectionReach * centreline_.radii[point]) ahead = ways.before[ahead];
    return (centreline_.points[ahead] - centreline_.points[point]).normalized();
}

Result<EntryPlace> LumenPlaces::entry_at(const WallPoint& wall) const {
    if (ends_.empty()) return Error{ErrorCode::BadValue, "no way leads through this vessel: its centreline is a single point"};
    const Index point = find_end_near(find_nearest_point(middle_at(wall).position));
    return EntryPlace{centreline_.points[point], direction_from(point), centreline_.radii[point]};
}

double LumenPlaces::free_ahead(const EntryPlace& entry, double clearance, double most) const {
    double length = 0.0;
    while (length < most && clearance_at(entry.position + (length + kStep) * entry.direction) >= clearance) length += kStep;
    return std::min(length, most);
}

} // namespace trocar::engine::viewer
