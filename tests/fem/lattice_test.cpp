#include "fem/mesh/lattice.hpp"

#include "base/topology.hpp"
#include "fem/embedding/links.hpp"
#include "fem/tissue/stable_step.hpp"
#include "tests/fem/bodies.hpp"

#include <gtest/gtest.h>

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

} // namespace trocar::fem
