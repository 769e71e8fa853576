#include "spheretree/lumen/lumen_path.hpp"

#include "spheretree/lumen/union_room.hpp"

#include <algorithm>
#include <cstdio>
#include <queue>

namespace trocar::spheretree {

namespace {

struct BestBall {
    Index ball = kNoIndex;
    double clearance = -std::numeric_limits<double>::infinity(); // m
};

BestBall find_best_ball(const LumenTree& lumen, const Vec3& p) {
    const SphereTree& tree = lumen.tree;
    BestBall best;
    std::vector<Index> stack{0};
    while (!stack.empty()) {
        const Index s = stack.back();
        stack.pop_back();
        const double clearance = tree.spheres[s].radius - (tree.spheres[s].centre - p).norm();
        if (tree.is_leaf(s)) {
            if (clearance > best.clearance) best = {lumen.ball_of_leaf(s), clearance};
        } else if (std::min(clearance, lumen.largest_ball[s]) > best.clearance) {
            for (Index c = 0; c < tree.child_count[s]; ++c) stack.push_back(tree.first_child[s] + c);
        }
    }
    return best;
}

/// Clearance everywhere between two overlapping spheres' centres; negative where they do not meet.
double passage(const Sphere& a, const Sphere& b) {
    const double distance = (a.centre - b.centre).norm();
    if (distance >= a.radius + b.radius) return -1.0;
    const double smaller = std::min(a.radius, b.radius);
    if (!(distance > 0.0)) return smaller;
    const double h = 0.5 * (distance + (a.radius - b.radius) * (a.radius + b.radius) / distance);
    if (h <= 0.0 || h >= distance) return smaller; // one centre lies in the lens
    return std::sqrt(std::max(0.0, a.radius * a.radius - h * h));
}

struct Step {
    double cost = 0.0;
    Index ball = kNoIndex;
    [[nodiscard]] bool operator>(const Step& other) const { return cost != other.cost ? cost > other.cost : ball > other.ball; }
};

struct Ways {
    std::vector<double> cost;     // [ball_count] infinite: not reached
    std::vector<Index> came_from; // [ball_count]
};

/// Shortest ways from ball to ball; `price(from, to)` is the cost of a step, negative where there is none, and
/// `total(cost so far, price)` joins them. Ends at `to`, where it is a ball.
template <class Price, class Total>
Ways find_ways(const LumenTree& lumen, Index from, Index to, Price&& price, Total&& total) {
    Ways ways{std::vector<double>(lumen.ball_count(), std::numeric_limits<double>::infinity()),
              std::vector<Index>(lumen.ball_count(), kNoIndex)};
    auto& [cost, came_from] = ways;
    std::priority_queue<Step, std::vector<Step>, std::greater<>> open;
    cost[from] = 0.0;
    open.push({0.0, from});
    while (!open.empty()) {
        const Step step = open.top();
        open.pop();
        if (step.cost > cost[step.ball]) continue;
        if (step.ball == to) break;
        for (const Index next : lumen.neighbours_of(step.ball)) {
            const double extra = price(step.ball, next);
            if (extra < 0.0) continue;
            const double reached = total(step.cost, extra);
            if (!(reached < cost[next])) continue;
            cost[next] = reached;
            came_from[next] = step.ball;
            open.push({reached, next});
        }
    }
    return ways;
}

/// Balls from the first to the last; empty: no way.
template <class Price, class Total>
std::vector<Index> find_way(const LumenTree& lumen, Index from, Index to, Price&& price, Total&& total) {
    const auto [cost, came_from] = find_ways(lumen, from, to, price, total);
    std::vector<Index> way;
    if (cost[to] == std::numeric_limits<double>::infinity()) return way;
    for (Index ball = to; ball != kNoIndex; ball = came_from[ball]) way.push_back(ball);
    std::reverse(way.begin(), way.end());
    return way;
}

std::vector<Index> find_wide_way(const LumenTree& lumen, Index from, Index to, double min_radius) {
    return find_way(
        lumen, from, to,
        [&](Index a, Index b) {
            const double clearance = passage(lumen.ball(a), lumen.ball(b));
            if (clearance <= 0.0 || clearance < min_radius) return -1.0;
            return (lumen.ball(a).centre - lumen.ball(b).centre).norm() / clearance;
        },
        [](double so_far, double extra) { return so_far + extra; });
}

/// Narrowest place of the widest route; 0 where there is none at all.
double widest_radius(const LumenTree& lumen, Index from, Index to) {
    const auto way = find_way( // cost: the largest 1/passage met so far
        lumen, from, to,
        [&](Index a, Index b) {
            const double clearance = passage(lumen.ball(a), lumen.ball(b));
            return clearance > 0.0 ? 1.0 / clearance : -1.0;
        },
        [](double so_far, double extra) { return std::max(so_far, extra); });
    double narrowest = way.empty() ? 0.0 : std::min(lumen.ball(from).radius, lumen.ball(to).radius);
    for (std::size_t i = 1; i < way.size(); ++i) narrowest = std::min(narrowest, passage(lumen.ball(way[i - 1]), lumen.ball(way[i])));
    return narrowest;
}

/// Points on the polyline, `spacing` apart at most, both ends kept.
std::vector<Vec3> divide(std::span<const Vec3> corners, double spacing) {
    double length = 0.0;
    for (std::size_t i = 1; i < corners.size(); ++i) length += (corners[i] - corners[i - 1]).norm();
    const auto parts = static_cast<std::size_t>(std::max(1.0, std::ceil(length / spacing)));
    std::vector<Vec3> points{corners.front()};
    double passed = 0.0; // length of the polyline before corner `i - 1`
    std::size_t i = 1;
    for (std::size_t k = 1; k < parts; ++k) {
        const double wanted = length * static_cast<double>(k) / static_cast<double>(parts);
        while (i + 1 < corners.size() && passed + (corners[i] - corners[i - 1]).norm() < wanted)
            passed += (corners[i] - corners[i - 1]).norm(), ++i;
        const double edge = (corners[i] - corners[i - 1]).norm();
        const double t = edge > 0.0 ? std::clamp((wanted - passed) / edge, 0.0, 1.0) : 0.0;
        points.emplace_back(corners[i - 1] + t * (corners[i] - corners[i - 1]));
    }
    points.push_back(corners.back());
    return points;
}

void smooth(const LumenTree& lumen, const PathOptions& options, std::vector<LumenPathPoint>& path) {
    std::vector<double> enough; // m, clearance that a point keeps
    for (const LumenPathPoint& p : path) enough.push_back(std::max(0.9 * p.radius, std::min(p.radius, options.min_radius)));
    for (unsigned round = 0; round < options.smoothing; ++round)
        for (std::size_t parity = 1; parity <= 2; ++parity) // odd points, then even ones: no order between neighbours
            for (std::size_t i = parity; i + 1 < path.size(); i += 2) {
                const Vec3 moved = 0.5 * path[i].centre + 0.25 * (path[i - 1].centre + path[i + 1].centre);
                const double clearance = free_radius_at(lumen, moved);
                if (clearance >= enough[i]) path[i] = {moved, clearance};
            }
}

/// The path need not pass the centre of the ball an end lies in when the next ball holds that end as well.
void drop_detours(const LumenTree& lumen, const Vec3& from, const Vec3& to, double min_radius, std::vector<Index>& way) {
    const auto holds = [&](Index ball, const Vec3& p) {
        const Sphere& b = lumen.ball(ball);
        return b.radius - (b.centre - p).norm() >= std::max(0.25 * b.radius, min_radius);
    };
    while (way.size() > 1 && holds(way[1], from)) way.erase(way.begin());
    while (way.size() > 1 && holds(way[way.size() - 2], to)) way.pop_back();
}

std::string in_mm(double metres) {
    char text[32];
    std::snprintf(text, sizeof text, "%.2f mm", 1e3 * metres);
    return text;
}

Result<Index> ball_near(const LumenTree& lumen, const Vec3& p, const char* which) {
    const BestBall best = find_best_ball(lumen, p);
    if (best.ball != kNoIndex && best.clearance >= -lumen.ball(best.ball).radius) return best.ball;
    return Error{ErrorCode::BadValue, std::string("the path's ") + which + " lies outside the lumen" +
                                          (best.ball == kNoIndex ? "" : ", by " + in_mm(-best.clearance)) + "; it must lie inside"};
}

} // namespace

double free_radius_at(const LumenTree& lumen, const Vec3& p) {
    const BestBall best = find_best_ball(lumen, p);
    if (best.ball == kNoIndex) return best.clearance;
    Clearance clearance = clearance_in_ball(p, lumen.ball(best.ball));
    for (const Index neighbour : lumen.neighbours_of(best.ball)) improve_clearance(p, lumen.ball(best.ball), lumen.ball(neighbour), clearance);
    return clearance.radius;
}

Result<std::vector<double>> find_way_lengths(const LumenTree& lumen, const Vec3& from) {
    const auto first = ball_near(lumen, from, "start");
    if (!first) return first.error();
    return find_ways(
               lumen, *first, kNoIndex,
               [&](Index a, Index b) {
                   return passage(lumen.ball(a), lumen.ball(b)) > 0.0 ? (lumen.ball(a).centre - lumen.ball(b).centre).norm() : -1.0;
               },
               [](double so_far, double extra) { return so_far + extra; })
        .cost;
}

Result<std::vector<LumenPathPoint>> find_lumen_path(const LumenTree& lumen, const Vec3& from, const Vec3& to, const PathOptions& options) {
    const auto first = ball_near(lumen, from, "start");
    if (!first) return first.error();
    const auto last = ball_near(lumen, to, "end");
    if (!last) return last.error();
    std::vector<Index> way = find_wide_way(lumen, *first, *last, options.min_radius);
    if (way.empty())
        return Error{ErrorCode::BadValue, "no route of radius " + in_mm(options.min_radius) +
                                              " leads through the lumen; the widest one has " + in_mm(widest_radius(lumen, *first, *last)) +
                                              " at its narrowest place"};
    drop_detours(lumen, from, to, options.min_radius, way);
    std::vector<Vec3> corners{from};
    for (const Index ball : way) corners.push_back(lumen.ball(ball).centre);
    corners.push_back(to);
    std::vector<LumenPathPoint> path;
    for (const Vec3& p : divide(corners, std::max(options.spacing, 1e-6))) path.push_back({p, free_radius_at(lumen, p)});
    smooth(lumen, options, path);
    return path;
}

} // namespace trocar::spheretree
