#include "fem/mesh/lattice.hpp"

#include "base/topology.hpp"
#include "fem/embedding/links.hpp"
#include "fem/tissue/stable_step.hpp"
#include "tests/fem/bodies.hpp"

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <random>

namespace trocar::fem {

using namespace test;

namespace {

/// Closed ball of n x 2n quads, split, radius m.
TriMesh make_ball(double radius, Index n) {
    TriMesh mesh;
    const double pi = 3.14159265358979323846;
    mesh.vertices.push_back(Vec3(0, 0, radius));
    for (Index i = 1; i < n; ++i)
        for (Index j = 0; j < 2 * n; ++j) {
            const double theta = pi * i / n, phi = pi * j / n;
            mesh.vertices.push_back(radius * Vec3(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)));
        }
    mesh.vertices.push_back(Vec3(0, 0, -radius));
    const auto id = [&](Index i, Index j) { return 1 + (i - 1) * 2 * n + j % (2 * n); };
    const auto last = static_cast<Index>(mesh.vertices.size() - 1);
    for (Index j = 0; j < 2 * n; ++j) {
        mesh.triangles.push_back({0, id(1, j), id(1, j + 1)});
        mesh.triangles.push_back({last, id(n - 1, j + 1), id(n - 1, j)});
        for (Index i = 1; i + 1 < n; ++i) {
            mesh.triangles.push_back({id(i, j), id(i + 1, j), id(i + 1, j + 1)});
            mesh.triangles.push_back({id(i, j), id(i + 1, j + 1), id(i, j + 1)});
        }
    }
    return mesh;
}

} // namespace

TEST(Lattice, FillsABallWithoutSliversInOnePiece) {
    const TriMesh ball = make_ball(0.1, 24);
    const double cell = find_lattice_cell(ball, 800);
    const auto mesh = make_lattice_mesh(ball, {.cell = cell});
    ASSERT_TRUE(mesh.ok()) << mesh.error().to_string();
    const TetMeshReport report = inspect_tets(mesh->tets);
    EXPECT_TRUE(report.valid());
    EXPECT_EQ(report.components, 1u);
    EXPECT_EQ(report.unreferenced_nodes, 0u);
    EXPECT_NEAR(mesh->volume_ratio, 1.0, 0.05);
    EXPECT_LT(mesh->farthest, cell);
    const auto triangles = boundary_surface(mesh->tets).triangles.size();
    EXPECT_GT(triangles, 500u);
    EXPECT_LT(triangles, 1400u);
    for (const Tet& t : mesh->tets.tets) {
        const Vec3 &o = mesh->tets.vertices[t[0]], a = mesh->tets.vertices[t[1]] - o, b = mesh->tets.vertices[t[2]] - o,
                   c = mesh->tets.vertices[t[3]] - o;
        const double face = std::sqrt(
            std::max({a.cross(b).squaredNorm(), a.cross(c).squaredNorm(), b.cross(c).squaredNorm(), (b - a).cross(c - a).squaredNorm()}));
        EXPECT_GE(a.dot(b.cross(c)) / face, 0.7 * cell / std::sqrt(2.0)); // altitude, against an undeformed tet's
    }
}

TEST(Lattice, MeshIsTheSameEveryTimeAndCarriesADenseSurface) {
    const TriMesh ball = make_ball(0.05, 16);
    const LatticeOptions options{.cell = find_lattice_cell(ball, 400)};
    const auto mesh = make_lattice_mesh(ball, options), again = make_lattice_mesh(ball, options);
    ASSERT_TRUE(mesh.ok());
    EXPECT_EQ(mesh->tets.vertices, again->tets.vertices);
    EXPECT_EQ(mesh->tets.tets, again->tets.tets);
    const auto links = make_surface_links(mesh->tets, ball);
    ASSERT_TRUE(links.ok());
    EXPECT_EQ(links->static_count, 0u);
    EXPECT_LT(links->max_length, 1.5 * options.cell);
}

TEST(Lattice, RefusesWhatItCannotFill) {
    const TriMesh ball = make_ball(0.05, 8);
    EXPECT_EQ(make_lattice_mesh(ball, {.cell = 0.0}).error().code, ErrorCode::BadValue);
    EXPECT_EQ(make_lattice_mesh(ball, {.cell = std::nan("")}).error().code, ErrorCode::BadValue);
    EXPECT_EQ(make_lattice_mesh(ball, {.cell = 1e-5}).error().code, ErrorCode::BadValue);
    const auto many = make_lattice_mesh(ball, {.cell = 1e-3}); // a million cells around it, and six million tetrahedra in them
    ASSERT_FALSE(many.ok());
    EXPECT_NE(many.error().message.find("tetrahedra"), std::string::npos) << many.error().message;
    EXPECT_EQ(make_lattice_mesh(ball, {.cell = 1.0}).error().code, ErrorCode::BadMesh);
    EXPECT_EQ(make_lattice_mesh({}, {.cell = 0.01}).error().code, ErrorCode::BadMesh);
}

namespace {

/// m; a box, a wedge or a tetrahedron of random sides and attitude.
TriMesh make_sharp_body(std::mt19937& engine) {
    const auto between = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine); };
    TriMesh mesh;
    const int kind = std::uniform_int_distribution<int>(0, 2)(engine);
    if (kind == 0) {
        for (int k = 0; k < 8; ++k) mesh.vertices.push_back(Vec3(k & 1, (k >> 1) & 1, k >> 2));
        mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4}, {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    } else if (kind == 1) {
        mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {0, 1, 1}};
        mesh.triangles = {{0, 2, 1}, {3, 4, 5}, {0, 1, 4}, {0, 4, 3}, {1, 2, 5}, {1, 5, 4}, {2, 0, 3}, {2, 3, 5}};
    } else {
        mesh.vertices = {{0.5, 0.5, 0.5}, {0.5, -0.5, -0.5}, {-0.5, 0.5, -0.5}, {-0.5, -0.5, 0.5}};
        mesh.triangles = {{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}};
    }
    std::normal_distribution<double> normal;
    const Eigen::Quaterniond turn = Eigen::Quaterniond(normal(engine), normal(engine), normal(engine), normal(engine)).normalized();
    const Vec3 extent(between(0.02, 0.05), between(0.02, 0.05), between(0.02, 0.05));
    for (Vec3& v : mesh.vertices) v = turn * v.cwiseProduct(extent);
    return mesh;
}

} // namespace

TEST(Lattice, HasANodeAtNearlyEverySharpCornerAndNoThinTet) {
    constexpr unsigned kSeed = 11;
    std::mt19937 engine(kSeed);
    std::size_t corners = 0, met = 0, linked = 0;
    for (int k = 0; k < 60; ++k) {
        const TriMesh body = make_sharp_body(engine);
        const double cell = find_lattice_cell(body, std::uniform_int_distribution<std::size_t>(150, 900)(engine));
        SCOPED_TRACE(testing::Message() << "seed " << kSeed << " case " << k << ", cell " << cell << " m");
        const auto mesh = make_lattice_mesh(body, {.cell = cell});
        ASSERT_TRUE(mesh.ok()) << mesh.error().to_string();
        EXPECT_TRUE(inspect_tets(mesh->tets).valid());
        EXPECT_EQ(mesh->corners, body.vertices.size());
        corners += mesh->corners;
        met += mesh->met_corners;
        EXPECT_GT(mesh->volume_ratio, 0.85);
        EXPECT_LT(mesh->volume_ratio, 1.2);
        for (const Vec3& corner : body.vertices)
            linked += std::any_of(mesh->tets.vertices.begin(), mesh->tets.vertices.end(), [&](const Vec3& node) { return (node - corner).norm() < 1e-9; });
        for (const Tet& t : mesh->tets.tets) {
            const Vec3 &o = mesh->tets.vertices[t[0]], a = mesh->tets.vertices[t[1]] - o, b = mesh->tets.vertices[t[2]] - o,
                       c = mesh->tets.vertices[t[3]] - o;
            const double face = std::sqrt(
                std::max({a.cross(b).squaredNorm(), a.cross(c).squaredNorm(), b.cross(c).squaredNorm(), (b - a).cross(c - a).squaredNorm()}));
            EXPECT_GE(a.dot(b.cross(c)) / face, 0.499 * cell / std::sqrt(2.0));
        }
    }
    EXPECT_EQ(linked, met) << "what the report says";
    EXPECT_GT(static_cast<double>(met), 0.9 * static_cast<double>(corners));
}

TEST(Lattice, OfACurvedSurfaceKnowsNoCorner) {
    const auto mesh = make_lattice_mesh(make_ball(0.05, 16), {.cell = 0.01});
    ASSERT_TRUE(mesh.ok());
    EXPECT_EQ(mesh->corners, 0u);
}

TEST(Lattice, OfStepsThatAreSmallerThanItsCellsFollowsNone) {
    TriMesh comb; // a bar of many teeth, finer than the cells
    constexpr Index kTeeth = 60;
    std::vector<Vec3> outline{{0.0, 0.0, 0.0}, {0.06, 0.0, 0.0}};
    for (Index k = kTeeth; k-- > 0;) {
        outline.emplace_back(0.001 * (k + 1), 0.02 + 0.001 * (k % 2), 0.0);
        outline.emplace_back(0.001 * k, 0.02 + 0.001 * (k % 2), 0.0);
    }
    const auto n = static_cast<Index>(outline.size());
    for (const double z : {0.0, 0.02})
        for (const Vec3& p : outline) comb.vertices.push_back(p + Vec3(0.0, 0.0, z));
    for (Index i = 0; i < n; ++i) {
        const Index j = (i + 1) % n;
        comb.triangles.push_back({i, j, j + n});
        comb.triangles.push_back({i, j + n, i + n});
    }
    const auto mesh = make_lattice_mesh(comb, {.cell = 0.006}); // open at both ends: its inside is known all the same
    ASSERT_TRUE(mesh.ok()) << mesh.error().to_string();
    EXPECT_GT(mesh->corners, 100u);
    EXPECT_EQ(mesh->met_corners, 0u);
}

} // namespace trocar::fem
