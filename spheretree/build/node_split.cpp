#include "spheretree/build/node_split.hpp"

#include "spheretree/bounding.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::spheretree {

namespace {

constexpr std::size_t kSurfaceCandidates = 64; // points of the surface itself: what is left where there is no inside
constexpr std::size_t kMergeStart = 256;       // medial balls that the merging starts from at most

/// Medial balls that touch the node's part of the surface to within half of its overhang.
std::vector<Ball> local_candidates(const NodeTask& task, const BodyDepth& body) {
    std::vector<Ball> found;
    const double slack = 0.5 * std::max(task.node.overhang(), 0.0);
    if (body.solid())
        for (const Ball& ball : task.medial) {
            if ((ball.centre - task.node.centre).norm() > task.node.radius + ball.depth + slack) continue;
            const double reach_sq = (ball.depth + slack) * (ball.depth + slack);
            const std::size_t stride = task.ids.size() / 512 + 1;
            for (std::size_t k = 0; k < task.ids.size(); k += stride)
                if ((task.points[task.ids[k]] - ball.centre).squaredNorm() <= reach_sq) {
                    found.push_back(ball);
                    break;
                }
        }
    return found;
}

void add_surface_candidates(const NodeTask& task, std::vector<Ball>& candidates) {
    const std::size_t count = std::min(task.ids.size(), kSurfaceCandidates);
    for (std::size_t k = 0; k < count; ++k) candidates.push_back({task.points[task.ids[k * task.ids.size() / count]], 0.0, 0.0});
}

} // namespace

std::vector<ChildBall> split_by_merging(const NodeTask& task, const BodyDepth& body) {
    std::vector<Ball> balls = local_candidates(task, body);
    if (balls.size() > kMergeStart) {
        std::vector<Ball> fewer;
        for (std::size_t k = 0; k < kMergeStart; ++k) fewer.push_back(balls[k * balls.size() / kMergeStart]);
        balls = std::move(fewer);
    }
    if (balls.size() < task.branching) add_surface_candidates(task, balls);
    for (Ball& ball : balls) ball.radius = std::max(ball.depth, 0.0);
    // Cost of a merge: overhang of the ball around both. Each ball knows its cheapest partner behind it.
    const auto merged = [&](const Ball& a, const Ball& b) {
        const Sphere s = enclose_two({a.centre, a.radius}, {b.centre, b.radius});
        const double share = (s.centre - a.centre).norm() / std::max((b.centre - a.centre).norm(), 1e-300);
        return Ball{s.centre, std::min(a.depth, b.depth) * (1.0 - share) + share * b.depth, s.radius};
    };
    struct Partner {
        double cost;
        std::size_t other;
    };
    const auto find_partner = [&](std::size_t i) {
        Partner best{std::numeric_limits<double>::infinity(), i};
        for (std::size_t j = i + 1; j < balls.size(); ++j)
            if (const double cost = merged(balls[i], balls[j]).overhang(); cost < best.cost) best = {cost, j};
        return best;
    };
    std::vector<Partner> partner;
    for (std::size_t i = 0; i < balls.size(); ++i) partner.push_back(find_partner(i));
    while (balls.size() > task.branching) {
        std::size_t i = 0;
        for (std::size_t k = 1; k < balls.size(); ++k)
            if (partner[k].cost < partner[i].cost) i = k;
        const std::size_t j = partner[i].other, last = balls.size() - 1;
        balls[i] = merged(balls[i], balls[j]);
        balls[i].depth = body.at(balls[i].centre);
        balls[j] = balls[last];
        balls.pop_back();
        partner.pop_back();
        for (std::size_t k = 0; k < balls.size(); ++k)
            if (k <= i || k == j || partner[k].other == i || partner[k].other == j || partner[k].other == last)
                partner[k] = find_partner(k);
    }
    std::vector<ChildBall> children;
    for (Ball ball : balls) {
        ball.radius = 0.0; // as large as its share asks for
        children.push_back({ball, {}});
    }
    return children;
}

std::vector<ChildBall> split_by_octants(const NodeTask& task, const BodyDepth& body) {
    std::vector<ChildBall> children;
    const Vec3 half = 0.5 * task.cell.extent(), lo = task.cell.lo;
    for (int octant = 0; octant < 8; ++octant) {
        Box3 cell;
        for (int axis = 0; axis < 3; ++axis) {
            cell.lo[axis] = lo[axis] + ((octant >> axis) & 1 ? half[axis] : 0.0);
            cell.hi[axis] = cell.lo[axis] + half[axis];
        }
        const Vec3 centre = cell.centre();
        children.push_back({Ball{centre, body.at(centre), 0.5 * cell.extent().norm() * kRoundOut}, cell});
    }
    return children;
}

} // namespace trocar::spheretree
