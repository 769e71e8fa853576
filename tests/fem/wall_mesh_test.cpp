// Walls around vessels: that no tetrahedron folds over, whatever the surface, that they are as thick as asked for, and that they widen under pressure as shells do.
#include "fem/mesh/wall_mesh.hpp"

#include "base/topology.hpp"
#include "fem/mesh/mapped_mesh.hpp"
#include "fem/tissue/classical_cases.hpp"
#include "tests/fem/bodies.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace trocar::fem {

namespace {

constexpr double kPi = std::numbers::pi;

TriMesh make_ball(double radius, Index parts) {
    TriMesh ball = make_octasphere(parts);
    for (Vec3& v : ball.vertices) v *= radius;
    return ball;
}

} // namespace

TEST(WallMesh, OfAnySurfaceHasNoTetrahedronThatIsFoldedOver) {
    std::mt19937_64 engine(11);
    struct {
        std::mt19937_64& engine;
        double between(double a, double b) { return std::uniform_real_distribution<double>(a, b)(engine); }
    } random{engine};
    std::size_t thinned = 0, whole = 0, made = 0;
    for (int k = 0; k < 60; ++k) {
        TriMesh surface = make_ball(0.01, static_cast<Index>(random.between(3.0, 12.0)));
        const double rough = k % 3 == 0 ? 0.0 : random.between(0.0, 0.25), dent = k % 4 == 1 ? random.between(0.3, 0.8) : 0.0;
        for (Vec3& v : surface.vertices) {
            const double down = std::max(0.0, v.z() / 0.01 - 0.6) / 0.4; // a pit at the top
            v *= (1.0 + rough * random.between(-1.0, 1.0)) * (1.0 - dent * down);
        }
        const WallOptions options{.thickness = random.between(0.0002, 0.006), .layers = static_cast<Index>(random.between(1.0, 4.99))};
        const auto wall = make_wall_mesh(surface, options);
        ASSERT_TRUE(wall.ok()) << wall.error().to_string();
        if (wall->folds) {
            EXPECT_LT(wall->least_share, kLeastWall) << k;
            EXPECT_TRUE(wall->tets.tets.empty());
            continue;
        }
        ++made;
        (wall->thinned > 0 ? thinned : whole) += 1;
        EXPECT_GE(wall->least_share, kLeastWall);
        EXPECT_EQ(wall->tets.tets.size(), 3u * options.layers * surface.triangles.size());
        const TetMeshReport report = inspect_tets(wall->tets);
        EXPECT_TRUE(report.valid()) << k;
        EXPECT_EQ(report.components, 1u);
        const TriMesh boundary = boundary_surface(wall->tets);
        const SurfaceReport skin = inspect_surface(boundary); // both sides, and nothing between them
        EXPECT_TRUE(skin.closed() && skin.manifold() && skin.oriented()) << k;
        EXPECT_EQ(skin.components, 2u) << k;
        EXPECT_EQ(boundary.triangles.size(), 2u * surface.triangles.size());
        for (std::size_t v = 0; v < surface.vertices.size(); ++v) ASSERT_EQ(wall->tets.vertices[v], surface.vertices[v]);
    }
    EXPECT_GT(thinned, 8u);
    EXPECT_GT(whole, 8u);
    EXPECT_GT(made, 30u);
}

TEST(WallMesh, OfASphereHasTheVolumeOfItsShell) {
    for (const Index layers : {1u, 3u}) {
        const TriMesh ball = make_ball(0.01, 16);
        const auto wall = make_wall_mesh(ball, {.thickness = 0.001, .layers = layers});
        ASSERT_TRUE(wall.ok() && !wall->folds);
        EXPECT_EQ(wall->thinned, 0u);
        EXPECT_NEAR(inspect_tets(wall->tets).volume / (4.0 / 3.0 * kPi * (std::pow(0.011, 3) - std::pow(0.01, 3))), 1.0, 0.01);
    }
}

TEST(WallMesh, OfAPipeWithFlatSidesIsAsThickAcrossThem) {
    constexpr Index kSides = 8, kRings = 5;
    TriMesh pipe;
    for (Index i = 0; i < kRings; ++i)
        for (Index j = 0; j < kSides; ++j) pipe.vertices.push_back(0.01 * Vec3(std::cos(2.0 * kPi * j / kSides), std::sin(2.0 * kPi * j / kSides), i));
    const auto id = [](Index i, Index j) { return i * kSides + j % kSides; };
    for (Index i = 0; i + 1 < kRings; ++i)
        for (Index j = 0; j < kSides; ++j) {
            pipe.triangles.push_back({id(i, j), id(i, j + 1), id(i + 1, j + 1)});
            pipe.triangles.push_back({id(i, j), id(i + 1, j + 1), id(i + 1, j)});
        }
    const auto wall = make_wall_mesh(pipe, {.thickness = 0.002, .layers = 2});
    ASSERT_TRUE(wall.ok() && !wall->folds);
    const double inner = 0.01 * std::cos(kPi / kSides), outer = inner + 0.002; // to the sides
    const double area = kSides * std::tan(kPi / kSides) * (outer * outer - inner * inner);
    EXPECT_NEAR(inspect_tets(wall->tets).volume / (area * 0.01 * (kRings - 1)), 1.0, 1e-9);
}

TEST(WallMesh, WidensUnderPressureAsLameSaysAndConverges) {
    for (const double nu : {0.3, 0.45, 0.49})
        for (const Index layers : {1u, 2u}) {
            const double coarse = shell_ratio(24, layers, nu), fine = shell_ratio(48, layers, nu);
            EXPECT_NEAR(fine, 1.0, 0.03) << nu << " " << layers;
            EXPECT_LT(std::abs(fine - 1.0), std::abs(coarse - 1.0) + 0.002) << nu << " " << layers;
        }
}

TEST(WallMesh, BendsMoreAsItShouldWithEachLayer) {
    double last = 10.0;
    for (const Index layers : {1u, 2u, 3u, 4u}) { // patches alone would not resist bending of one layer but by what holds them together
        const double ratio = crushed_ring_ratio(96, layers, 0.45);
        EXPECT_LT(std::abs(ratio - 1.0), std::abs(last - 1.0)) << layers;
        last = ratio;
    }
    EXPECT_NEAR(last, 1.0, 0.05);
}

TEST(WallMesh, RefusesWhatIsNoWall) {
    const TriMesh ball = make_ball(0.01, 4);
    EXPECT_FALSE(make_wall_mesh(ball, {.thickness = 0.0, .layers = 1}).ok());
    EXPECT_FALSE(make_wall_mesh(ball, {.thickness = 0.001, .layers = 0}).ok());
    EXPECT_FALSE(make_wall_mesh(TriMesh{}, {.thickness = 0.001, .layers = 1}).ok());
}

} // namespace trocar::fem
