#include "base/closest_point.hpp"

#include "test_meshes.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

using namespace trocar;
using namespace trocar::test;

namespace {

/// Distance by dense sampling of the weights, refined around the best sample.
double sampled_distance(const Vec3& p, const std::array<Vec3, 3>& t) {
    double best = std::numeric_limits<double>::infinity(), best_u = 0, best_v = 0, window = 1.0;
    for (int round = 0; round < 12; ++round, window *= 0.25) {
        const double u0 = best_u, v0 = best_v;
        for (int i = -8; i <= 8; ++i)
            for (int j = -8; j <= 8; ++j) {
                const double u = std::clamp(u0 + window * i / 8, 0.0, 1.0), v = std::clamp(v0 + window * j / 8, 0.0, 1.0 - u);
                const double d = (p - (t[0] + u * (t[1] - t[0]) + v * (t[2] - t[0]))).norm();
                if (d < best) best = d, best_u = u, best_v = v;
            }
    }
    return best;
}

void expect_valid(const PointOnTriangle& hit, const std::array<Vec3, 3>& t, const Vec3& p) {
    const Vec3 rebuilt = hit.bary[0] * t[0] + hit.bary[1] * t[1] + hit.bary[2] * t[2];
    EXPECT_NEAR((rebuilt - hit.point).norm(), 0.0, 1e-14 * (1.0 + p.norm()));
    for (const double w : hit.bary) EXPECT_TRUE(w >= 0.0 && w <= 1.0) << w;
    EXPECT_NEAR(hit.distance_sq, (p - hit.point).squaredNorm(), 1e-14);
}

} // namespace

TEST(ClosestPoint, MatchesSamplingOnRandomTriangles) {
    Random random{77};
    SCOPED_TRACE(random.trace());
    for (int trial = 0; trial < 400; ++trial) {
        const std::array<Vec3, 3> t{random.point(), random.point(), random.point()};
        const Vec3 p = random.point(2.0);
        const PointOnTriangle hit = closest_on_triangle(p, t[0], t[1], t[2]);
        expect_valid(hit, t, p);
        const double sampled = sampled_distance(p, t);
        EXPECT_LE(std::sqrt(hit.distance_sq), sampled + 1e-12);
        EXPECT_NEAR(std::sqrt(hit.distance_sq), sampled, 1e-3);
    }
}

/// Obtuse triangles and slivers, on whose far edges the nearest point lies although the point is beyond another one.
TEST(ClosestPoint, IsThatOfTheNearestEdgeOrOfTheFace) {
    Random random{78};
    SCOPED_TRACE(random.trace());
    for (int trial = 0; trial < 100000; ++trial) {
        const Vec3 a = random.point(), along = random.point(), b = a + along;
        const double thin = std::pow(10.0, random.uniform(-6.0, 0.0));
        const Vec3 c = a + random.uniform(-2.0, 3.0) * along + thin * random.point();
        const Vec3 p = a + std::pow(10.0, random.uniform(-3.0, 1.0)) * random.point() + random.uniform(-1.0, 2.0) * along;
        const PointOnTriangle hit = closest_on_triangle(p, a, b, c);
        double edges_sq = std::numeric_limits<double>::infinity();
        for (const auto& [from, to] : {std::pair(a, b), std::pair(b, c), std::pair(c, a)}) edges_sq = std::min(edges_sq, closest_on_segment(p, {from, to}).distance_sq);
        ASSERT_LE(hit.distance_sq, edges_sq) << trial;
        const bool on_edge = std::min({hit.bary[0], hit.bary[1], hit.bary[2]}) == 0.0;
        if (on_edge) ASSERT_EQ(hit.distance_sq, edges_sq) << trial;
    }
}

/// A proof by the plane is never wrong, however thin, far off or small the triangle is; and it is found where the plane shows it.
TEST(ClosestPoint, BeyondThePlaneMeansBeyondTheRadius) {
    Random random{91};
    SCOPED_TRACE(random.trace());
    std::size_t proven = 0, could = 0;
    for (int trial = 0; trial < 200000; ++trial) {
        const double size = std::pow(10.0, random.uniform(-6.0, 2.0)), thin = std::pow(10.0, random.uniform(-7.0, 0.0));
        const Vec3 origin = random.point(std::pow(10.0, random.uniform(-3.0, 3.0)));
        const Vec3 along = random.point(size), a = origin + random.point(size), b = a + along;
        const Vec3 c = a + random.uniform(-1.0, 2.0) * along + thin * random.point(size);
        const Vec3 p = a + random.point(2.0 * size);
        // seen from a corner: far from the origin the closest point itself is rounded to where it lies
        const double distance = std::sqrt(closest_on_triangle(p - a, Vec3::Zero(), b - a, c - a).distance_sq);
        for (const double share : {0.2, 0.9, 1.0 - 1e-6, 1.0 - 1e-12, 1.0, 1.0 + 1e-12, 1.5}) {
            const bool beyond = is_beyond_plane(p, a, b, c, share * distance);
            ASSERT_TRUE(!beyond || share <= 1.0) << "trial " << trial << ", share " << share;
            if (share != 0.2) continue;
            const Vec3 normal = (b - a).cross(c - a);
            const bool clear = std::abs(normal.dot(p - a)) > 0.3 * distance * normal.norm() && thin > 0.1;
            could += clear && normal.norm() > 1e-2 * (b - a).norm() * (c - a).norm();
            proven += clear && beyond && normal.norm() > 1e-2 * (b - a).norm() * (c - a).norm();
        }
    }
    EXPECT_GT(could, 5000u);
    EXPECT_EQ(proven, could);
}

TEST(ClosestPoint, OnASliverTriangleIsTheSameForAllSixVertexOrders) {
    Random random{5};
    SCOPED_TRACE(random.trace());
    for (int trial = 0; trial < 2000; ++trial) {
        const Vec3 a = random.point(), b = random.point();
        const double height = std::pow(10.0, -random.uniform(0.0, 17.0));
        std::array<Vec3, 3> t{a, b, a + random.uniform(0.0, 1.0) * (b - a) + height * random.point()};
        const Vec3 p = random.point(trial % 2 == 0 ? 1.0 : 1e-3) + t[2];
        std::array<int, 3> order{0, 1, 2};
        double least = std::numeric_limits<double>::infinity(), most = 0.0;
        do {
            const PointOnTriangle hit = closest_on_triangle(p, t[order[0]], t[order[1]], t[order[2]]);
            expect_valid(hit, {t[order[0]], t[order[1]], t[order[2]]}, p);
            least = std::min(least, std::sqrt(hit.distance_sq));
            most = std::max(most, std::sqrt(hit.distance_sq));
        } while (std::next_permutation(order.begin(), order.end()));
        EXPECT_LE(most - least, 1e-9) << height;
    }
}

TEST(ClosestPoint, DegenerateTrianglesAreSegmentsAndPoints) {
    const Vec3 p(0.3, 1.0, 0.0), a(0, 0, 0), b(1, 0, 0);
    EXPECT_DOUBLE_EQ(closest_on_triangle(p, a, b, a).distance_sq, 1.0);
    EXPECT_DOUBLE_EQ(closest_on_triangle(p, a, b, 0.25 * b).distance_sq, 1.0);
    EXPECT_DOUBLE_EQ(closest_on_triangle(p, b, b, b).distance_sq, 0.49 + 1.0);
    EXPECT_EQ(closest_on_segment(p, {a, a}).parameter, 0.0);
}

TEST(ClosestPoint, TinyAndFarTrianglesKeepRelativeAccuracy) {
    const Vec3 offset(1e3, -1e3, 1e3);
    const double size = 1e-9;
    const Vec3 a = Vec3::Zero(), b(size, 0, 0), c(0, size, 0), p(0.25 * size, 0.25 * size, 2 * size);
    EXPECT_NEAR(std::sqrt(closest_on_triangle(p, a, b, c).distance_sq), 2 * size, 1e-12 * size);
    EXPECT_NEAR(std::sqrt(closest_on_triangle(p + offset, a, b, c).distance_sq), offset.norm(), 1e-8);
}

TEST(ClosestSegments, MatchSamplingAndNeverLoseToTheEndPoints) {
    Random random{31};
    SCOPED_TRACE(random.trace());
    for (int trial = 0; trial < 500; ++trial) {
        const Segment a{random.point(), random.point()};
        Segment b{random.point(), random.point()};
        if (trial % 3 == 0) b.to = b.from + (a.to - a.from) + 1e-9 * random.point(); // nearly parallel
        if (trial % 50 == 0) b.to = b.from;
        const PointsOnSegments hit = closest_on_segments(a, b);
        double sampled = std::numeric_limits<double>::infinity();
        for (int i = 0; i <= 400; ++i) {
            const Vec3 on_a = a.from + i / 400.0 * (a.to - a.from);
            sampled = std::min(sampled, std::sqrt(closest_on_segment(on_a, b).distance_sq));
        }
        EXPECT_LE(std::sqrt(hit.distance_sq), sampled + 1e-12);
        EXPECT_NEAR(std::sqrt(hit.distance_sq), sampled, 1e-2);
        EXPECT_NEAR((hit.point_a - hit.point_b).squaredNorm(), hit.distance_sq, 1e-15);
        EXPECT_TRUE(hit.s >= 0 && hit.s <= 1 && hit.t >= 0 && hit.t <= 1);
    }
}

TEST(ClosestSegments, CrossingOnesTouch) {
    const PointsOnSegments hit = closest_on_segments({Vec3(-1, 0, 0), Vec3(1, 0, 0)}, {Vec3(0, -1, 0), Vec3(0, 3, 0)});
    EXPECT_EQ(hit.distance_sq, 0.0);
    EXPECT_DOUBLE_EQ(hit.s, 0.5);
    EXPECT_DOUBLE_EQ(hit.t, 0.25);
}
