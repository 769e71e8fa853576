#include "assets/anatomy/shapes.hpp"

#include "base/self_intersection.hpp"
#include "base/topology.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace trocar::anatomy {
namespace {

constexpr double kPi = 3.14159265358979323846;

void expect_closed_body(const TriMesh& mesh, double volume, double tolerance) {
    const SurfaceReport report = inspect_surface(mesh);
    EXPECT_TRUE(report.closed());
    EXPECT_TRUE(report.manifold());
    EXPECT_TRUE(report.oriented());
    EXPECT_EQ(report.components, 1u);
    EXPECT_EQ(report.unreferenced_vertices, 0u);
    EXPECT_NEAR(report.signed_volume, volume, tolerance * volume);
    EXPECT_EQ(find_self_intersections(mesh, 1).count, 0u);
}

TEST(Shapes, TheIcosphereIsClosedAndNearlyABall) {
    const TriMesh ball = make_icosphere({0.1, -0.2, 0.3}, 0.05, 4);
    EXPECT_EQ(ball.triangles.size(), 20u * 256u);
    expect_closed_body(ball, 4.0 / 3.0 * kPi * std::pow(0.05, 3), 0.01);
    for (const Vec3& v : ball.vertices) EXPECT_NEAR((v - Vec3(0.1, -0.2, 0.3)).norm(), 0.05, 1e-15);
}

TEST(Shapes, TheBoxHasItsVolumeAtAnyResolution) {
    for (const int cells : {1, 2, 7}) {
        const TriMesh box = make_box({1, 2, 3}, {0.1, 0.2, 0.4}, cells);
        EXPECT_EQ(box.triangles.size(), 12u * static_cast<std::size_t>(cells * cells));
        expect_closed_body(box, 0.1 * 0.2 * 0.4, 1e-12);
    }
}

TEST(Shapes, TheCapsuleIsATubeWithTwoHalfBalls) {
    const double r = 0.01, length = 0.08;
    expect_closed_body(make_capsule({0, 0, 0}, {0, length, 0}, r, 48), kPi * r * r * length + 4.0 / 3.0 * kPi * r * r * r, 0.01);
}

TEST(Shapes, ATubeFollowsABendWithoutCrossingItself) {
    std::vector<Vec3> points;
    std::vector<double> radii;
    for (int k = 0; k <= 40; ++k) {
        const double angle = kPi * k / 40;
        points.emplace_back(0.05 * std::cos(angle), 0.05 * std::sin(angle), 0.02 * angle);
        radii.push_back(0.004 + 0.0001 * k);
    }
    const TriMesh tube = make_tube(points, radii, 24);
    const SurfaceReport report = inspect_surface(tube);
    EXPECT_TRUE(report.closed() && report.manifold() && report.oriented());
    EXPECT_GT(report.signed_volume, 0.0);
    EXPECT_EQ(find_self_intersections(tube, 1).count, 0u);
}

TEST(Shapes, TheCoarsestTubeIsStillClosed) {
    const Vec3 points[] = {{0, 0, 0}, {0, 0, 1}};
    const double radii[] = {0.1, 0.1};
    const SurfaceReport report = inspect_surface(make_tube(points, radii, 3));
    EXPECT_TRUE(report.closed() && report.manifold() && report.oriented());
}

TEST(Shapes, TheTorusHasAHandle) {
    const TriMesh torus = make_torus(Vec3::Zero(), 0.05, 0.015, 96, 48);
    expect_closed_body(torus, 2 * kPi * kPi * 0.05 * 0.015 * 0.015, 0.01);
    const long edges = static_cast<long>(unique_edges(torus.triangles).size());
    EXPECT_EQ(static_cast<long>(torus.vertices.size()) - edges + static_cast<long>(torus.triangles.size()), 0);
}

} // namespace
} // namespace trocar::anatomy
