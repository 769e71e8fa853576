#include "spheretree/lumen/wall_links.hpp"

#include "spheretree/build/point_tree.hpp"

#include <Eigen/LU>

#include <cmath>

namespace trocar::spheretree {

namespace {

/// Enough to pin down an affine motion with some to spare for smoothness. More: smoother, slower.
constexpr std::size_t kAnchors = 8;
/// Weights beyond this would amplify the wall's motion: the plain mean is taken instead.
constexpr double kLargestWeight = 1.0;

void find_wall_triangles(const LumenTree& lumen, const TriangleTree& wall, const Sphere& reach, std::vector<Index>& out) {
    out.clear();
    Box3 box;
    box.add(reach.centre);
    box.inflate(reach.radius);
    wall.for_each_overlapping(box, [&](Index t) {
        const Triangle& v = lumen.triangles[t];
        const auto hit = closest_on_triangle(reach.centre, lumen.rest_vertices[v[0]], lumen.rest_vertices[v[1]], lumen.rest_vertices[v[2]]);
        if (hit.distance_sq <= reach.radius * reach.radius) out.push_back(t);
    });
    std::sort(out.begin(), out.end());
}

/// Farthest-point sampling from the vertex nearest to the centre: anchors on all sides of the ball.
std::vector<Index> spread_anchors(const LumenTree& lumen, std::span<const Index> triangles, const Vec3& centre) {
    std::vector<Index> ids;
    for (const Index t : triangles) ids.insert(ids.end(), lumen.triangles[t].begin(), lumen.triangles[t].end());
    std::sort(ids.begin(), ids.end());
    ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
    std::vector<Index> chosen;
    if (ids.empty()) return chosen;
    std::vector<double> distance_sq(ids.size());
    std::size_t next = 0;
    for (std::size_t i = 0; i < ids.size(); ++i) {
        distance_sq[i] = (lumen.rest_vertices[ids[i]] - centre).squaredNorm();
        if (distance_sq[i] < distance_sq[next]) next = i;
    }
    std::fill(distance_sq.begin(), distance_sq.end(), std::numeric_limits<double>::infinity());
    while (chosen.size() < kAnchors && distance_sq[next] > 0.0) {
        chosen.push_back(ids[next]);
        const Vec3 last = lumen.rest_vertices[ids[next]];
        for (std::size_t i = 0; i < ids.size(); ++i)
            distance_sq[i] = std::min(distance_sq[i], (lumen.rest_vertices[ids[i]] - last).squaredNorm());
        next = static_cast<std::size_t>(std::max_element(distance_sq.begin(), distance_sq.end()) - distance_sq.begin());
    }
    return chosen;
}

/// Smallest change of the equal weights that makes the weighted mean of the anchors the centre, so that the centre moves
/// exactly with any affine motion of the wall. Without it a turn by R would misplace it by (R - I)(mean - centre).
std::vector<double> balance(const LumenTree& lumen, std::span<const Index> anchors, const Vec3& centre, double scale) {
    const auto n = static_cast<Eigen::Index>(anchors.size());
    std::vector<double> equal(anchors.size(), 1.0 / static_cast<double>(std::max<Eigen::Index>(n, 1)));
    if (n < 4) return equal;
    Eigen::Matrix4Xd moments(4, n);
    for (Eigen::Index k = 0; k < n; ++k)
        moments.col(k) << 1.0, (lumen.rest_vertices[anchors[static_cast<std::size_t>(k)]] - centre) / scale;
    const Eigen::VectorXd start = Eigen::VectorXd::Constant(n, 1.0 / static_cast<double>(n));
    const Eigen::Vector4d missing = Eigen::Vector4d::UnitX() - moments * start;
    const Eigen::Matrix4d gram = moments * moments.transpose();
    const Eigen::VectorXd weights = start + moments.transpose() * gram.fullPivLu().solve(missing);
    const bool exact = (moments * weights - Eigen::Vector4d::UnitX()).norm() < 1e-9;
    if (!exact || weights.cwiseAbs().maxCoeff() > kLargestWeight) return equal;
    return {weights.data(), weights.data() + n};
}

} // namespace

void add_wall_links(LumenTree& lumen, const TriangleTree& wall, double link_reach) {
    lumen.wall_begin.assign(1, 0);
    lumen.anchor_begin.assign(1, 0);
    std::vector<Index> triangles;
    for (Index b = 0; b < lumen.ball_count(); ++b) {
        const Sphere& ball = lumen.ball(b);
        find_wall_triangles(lumen, wall, {ball.centre, ball.radius * (1.0 + link_reach)}, triangles);
        lumen.wall_triangles.insert(lumen.wall_triangles.end(), triangles.begin(), triangles.end());
        lumen.wall_begin.push_back(static_cast<Index>(lumen.wall_triangles.size()));
        const std::vector<Index> anchors = spread_anchors(lumen, triangles, ball.centre);
        const std::vector<double> weights = balance(lumen, anchors, ball.centre, ball.radius);
        lumen.anchors.insert(lumen.anchors.end(), anchors.begin(), anchors.end());
        lumen.anchor_weights.insert(lumen.anchor_weights.end(), weights.begin(), weights.end());
        lumen.anchor_begin.push_back(static_cast<Index>(lumen.anchors.size()));
    }
}

void add_neighbours(LumenTree& lumen) {
    std::vector<Vec3> centres;
    double largest = 0.0;
    for (Index b = 0; b < lumen.ball_count(); ++b) {
        centres.push_back(lumen.ball(b).centre);
        largest = std::max(largest, lumen.ball(b).radius);
    }
    const PointTree tree(centres);
    lumen.neighbour_begin.assign(1, 0);
    for (Index b = 0; b < lumen.ball_count(); ++b) {
        const Sphere& ball = lumen.ball(b);
        const auto begin = static_cast<std::ptrdiff_t>(lumen.neighbours.size());
        tree.for_each_within(ball.centre, ball.radius + largest, [&](Index k, double distance_sq) {
            const double touch = ball.radius + lumen.ball(k).radius;
            if (k != b && distance_sq < touch * touch) lumen.neighbours.push_back(k);
        });
        std::sort(lumen.neighbours.begin() + begin, lumen.neighbours.end());
        lumen.neighbour_begin.push_back(static_cast<Index>(lumen.neighbours.size()));
    }
}

} // namespace trocar::spheretree
