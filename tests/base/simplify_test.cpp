#include "base/inside.hpp"
#include "base/repair.hpp"
#include "base/simplify.hpp"

#include "test_meshes.hpp"
#include "tests/made/surfaces.hpp"

using namespace trocar;
using namespace trocar::test;

namespace {

double worst_distance(const TriMesh& from, const TriMesh& to) {
    const TriangleTree tree(to);
    double worst = 0.0;
    for (const Vec3& v : from.vertices) worst = std::max(worst, tree.closest(v)->distance);
    return worst;
}

} // namespace

TEST(Simplify, ASphereStaysAClosedSphereNearTheOldOne) {
    const TriMesh sphere = make_sphere(5); // 8192
    const auto fewer = simplify(sphere, 800);
    ASSERT_TRUE(fewer.ok());
    EXPECT_LE(fewer->triangles.size(), 800u);
    EXPECT_GE(fewer->triangles.size(), 798u);
    EXPECT_TRUE(check_closed_surface(*fewer).ok());
    EXPECT_NEAR(signed_volume(*fewer), signed_volume(sphere), 0.01 * signed_volume(sphere));
    EXPECT_LT(worst_distance(*fewer, sphere), 0.01);
    EXPECT_LT(worst_distance(sphere, *fewer), 0.02);
}

TEST(Simplify, GenusSurvivesTheSmallestTarget) {
    const auto torus = simplify(make_torus(40, 20), 4);
    ASSERT_TRUE(torus.ok());
    EXPECT_TRUE(check_closed_surface(*torus).ok());
    const long euler = long(torus->vertices.size()) - long(unique_edges(torus->triangles).size()) + long(torus->triangles.size());
    EXPECT_EQ(euler, 0);
    EXPECT_LT(torus->triangles.size(), 200u);
    const auto ball = simplify(make_sphere(3), 1);
    ASSERT_TRUE(ball.ok());
    EXPECT_TRUE(check_closed_surface(*ball).ok());
    EXPECT_GE(ball->triangles.size(), 4u);
}

TEST(Simplify, AnOpenBorderKeepsItsShape) {
    const auto grid = simplify(make_grid(30), 60);
    ASSERT_TRUE(grid.ok());
    const SurfaceReport report = inspect_surface(*grid);
    EXPECT_TRUE(report.manifold() && report.oriented());
    double area = 0.0;
    for (const Triangle& t : grid->triangles)
        area += 0.5 * (grid->vertices[t[1]] - grid->vertices[t[0]]).cross(grid->vertices[t[2]] - grid->vertices[t[0]])[2];
    EXPECT_NEAR(area, 1.0, 1e-3);
    EXPECT_LE(grid->triangles.size(), 60u);
}

/// The counts are those of rounds that each try every edge: an edge that is passed over because nothing around it has changed would be refused.
TEST(Simplify, UnderAnErrorBoundGoesAsFarAsIfEveryRoundTriedEveryEdge) {
    struct Case {
        double error;
        std::size_t triangles;
        double volume;
    };
    TriMesh rough = make_sphere(5);
    std::uint64_t seed = 1; // xorshift64* (Vigna 2016)
    for (Vec3& x : rough.vertices) {
        seed ^= seed >> 12, seed ^= seed << 25, seed ^= seed >> 27;
        x *= 1.0 + 0.03 * static_cast<double>(static_cast<std::int64_t>(seed * 0x2545f4914f6cdd1dULL)) * 0x1p-63;
    }
    for (const Case& c : {Case{0.002, 8084, 4.1854573178188961}, Case{0.01, 3942, 4.1839064776560049}, Case{0.05, 322, 4.1000464886858188}}) {
        const auto fewer = simplify(rough, 4, {.max_error = c.error});
        ASSERT_TRUE(fewer.ok());
        EXPECT_EQ(fewer->triangles.size(), c.triangles) << c.error;
        EXPECT_NEAR(signed_volume(*fewer), c.volume, 1e-12) << c.error;
    }
}

TEST(Simplify, ASecondRunGivesTheSameBits) {
    const TriMesh torus = make_torus(50, 20);
    const auto once = simplify(torus, 500), twice = simplify(torus, 500);
    ASSERT_TRUE(once.ok() && twice.ok());
    EXPECT_EQ(once->triangles, twice->triangles);
    EXPECT_EQ(once->vertices, twice->vertices);
}

TEST(Simplify, ScaleAndFarOriginDoNotMatter) {
    for (const double size : {1e-9, 1.0, 1e6}) {
        TriMesh sphere = make_sphere(4, size, Vec3::Constant(1000 * size));
        const auto fewer = simplify(sphere, 300);
        ASSERT_TRUE(fewer.ok());
        EXPECT_LE(fewer->triangles.size(), 300u);
        EXPECT_LT(worst_distance(*fewer, sphere), 0.02 * size);
    }
}

TEST(Simplify, MaxErrorStopsEarly) {
    SimplifyOptions options;
    options.max_error = 1e-3;
    const TriMesh sphere = make_sphere(5);
    const auto fewer = simplify(sphere, 4, options);
    ASSERT_TRUE(fewer.ok());
    EXPECT_GT(fewer->triangles.size(), 100u);
    EXPECT_LT(fewer->triangles.size(), sphere.triangles.size());
    EXPECT_LT(worst_distance(*fewer, sphere), 0.01);
}

TEST(Simplify, RefusesWhatItCannotKeepManifold) {
    EXPECT_FALSE(simplify({}, 10).ok());
    EXPECT_FALSE(simplify(make_cube(), 0).ok());
    TriMesh fin = make_cube();
    fin.vertices.emplace_back(2, 2, 2);
    fin.triangles.push_back({0, 1, 8});
    const auto refused = simplify(fin, 6);
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::BadMesh);
    TriMesh broken = make_cube();
    broken.vertices[0][0] = std::nan("");
    EXPECT_FALSE(simplify(broken, 6).ok());
    broken = make_cube();
    broken.triangles[0][0] = 99;
    EXPECT_FALSE(simplify(broken, 6).ok());
}

TEST(Simplify, MadeOrgansAnimalsAndArteriesStayClosed) {
    for (const TriMesh& mesh :
         {made::make_organ(1, 5), made::make_organ(2, 5), made::make_animal(1, 20000), made::make_artery_tree(1, 20000)}) {
        ASSERT_GT(mesh.triangles.size(), 13000u);
        for (const std::size_t target : {12000u, 1500u}) {
            const auto fewer = simplify(mesh, target);
            ASSERT_TRUE(fewer.ok());
            EXPECT_LE(fewer->triangles.size(), target);
            EXPECT_TRUE(check_closed_surface(*fewer).ok());
            EXPECT_NEAR(signed_volume(*fewer), signed_volume(mesh), 0.03 * signed_volume(mesh));
        }
    }
}

TEST(Simplify, RealOrgansStayClosed) {
    for (const char* name : {"stanford/bunny_60k_manifold.obj.gz", "organs/hra_vhm_spleen_17k.obj.gz", "stanford/armadillo_86k.obj.gz"}) {
        SCOPED_TRACE(name);
        TROCAR_LOAD_OR_SKIP(mesh, name);
        ASSERT_TRUE(apply_repair(mesh, Repair::Weld).ok());
        for (const std::size_t target : {12000u, 1500u}) {
            const auto fewer = simplify(mesh, target);
            ASSERT_TRUE(fewer.ok());
            EXPECT_LE(fewer->triangles.size(), target);
            EXPECT_TRUE(check_closed_surface(*fewer).ok());
            EXPECT_NEAR(signed_volume(*fewer), signed_volume(mesh), 0.03 * signed_volume(mesh));
        }
    }
}
