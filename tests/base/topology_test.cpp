#include "base/repair.hpp"
#include "base/topology.hpp"

#include "test_meshes.hpp"
#include "tests/made/surfaces.hpp"

using namespace trocar;
using namespace trocar::test;

TEST(SurfaceReport, ACubeHasNoDefects) {
    const SurfaceReport report = inspect_surface(make_cube(2.0));
    EXPECT_TRUE(report.closed() && report.manifold() && report.oriented() && report.finite());
    EXPECT_EQ(report.components, 1u);
    EXPECT_DOUBLE_EQ(report.signed_volume, 8.0);
    EXPECT_TRUE(report.bad_triangles.empty());
    EXPECT_TRUE(check_closed_surface(make_cube()).ok());
}

TEST(SurfaceReport, CountsBorderAndNamesItsTriangles) {
    TriMesh cube = make_cube();
    cube.triangles.resize(10);
    const SurfaceReport report = inspect_surface(cube);
    EXPECT_EQ(report.boundary_edges, 4u);
    EXPECT_FALSE(report.closed());
    EXPECT_EQ(report.bad_triangles.size(), 4u);
    const Result<void> check = check_closed_surface(cube);
    ASSERT_FALSE(check.ok());
    EXPECT_NE(check.error().message.find("4 open border edges"), std::string::npos) << check.error().message;
}

TEST(SurfaceReport, AFlippedFaceMakesThreeInconsistentEdges) {
    TriMesh cube = make_cube();
    std::swap(cube.triangles[5][0], cube.triangles[5][1]);
    EXPECT_EQ(inspect_surface(cube).inconsistent_edges, 3u);
    EXPECT_EQ(inspect_surface(cube).boundary_edges, 0u);
}

TEST(SurfaceReport, InwardSurfacesFailTheClosedCheckByName) {
    const Result<void> check = check_closed_surface(flipped(make_cube()));
    ASSERT_FALSE(check.ok());
    EXPECT_NE(check.error().message.find("inward"), std::string::npos);
}

TEST(SurfaceReport, CountsDegenerateDuplicateAndNonFinite) {
    TriMesh mesh = make_cube();
    mesh.triangles.push_back({0, 0, 1});
    mesh.triangles.push_back({0, 1, 77});
    mesh.triangles.push_back({3, 0, 2}); // the first one again, rotated
    mesh.vertices.emplace_back(0.5, 0.0, 0.0);
    mesh.triangles.push_back({0, 8, 1}); // on one line
    mesh.vertices.emplace_back(std::nan(""), 0.0, 0.0);
    const SurfaceReport report = inspect_surface(mesh);
    EXPECT_EQ(report.degenerate_triangles, 3u);
    EXPECT_EQ(report.duplicate_triangles, 1u);
    EXPECT_EQ(report.non_finite_vertices, 1u);
    EXPECT_EQ(report.unreferenced_vertices, 1u);
    EXPECT_EQ(report.bad_triangles.front(), 12u);
    EXPECT_GE(report.nonmanifold_edges, 3u);
}

TEST(SurfaceReport, ABowtieIsEdgeManifoldButPinchedAtAVertex) {
    TriMesh two = join(make_cube(), make_cube(1.0, Vec3(1, 1, 1)));
    for (Triangle& t : two.triangles)
        for (Index& v : t)
            if (v == 8) v = 7; // the corner where they touch
    const SurfaceReport report = inspect_surface(two);
    EXPECT_EQ(report.nonmanifold_edges, 0u);
    EXPECT_EQ(report.nonmanifold_vertices, 1u);
    EXPECT_EQ(report.components, 1u);
    EXPECT_EQ(find_components(two.triangles, two.vertices.size(), Joined::BySharedEdges).count, 2u);
}

TEST(SurfaceReport, AnEmptyMeshIsNotClosed) {
    EXPECT_FALSE(inspect_surface({}).closed());
    EXPECT_FALSE(check_closed_surface({}).ok());
}

TEST(SurfaceReport, VolumeSurvivesAFarOrigin) {
    EXPECT_NEAR(inspect_surface(make_cube(1.0, Vec3(1e8, -1e8, 1e8))).signed_volume, 1.0, 1e-12);
}

TEST(Adjacency, EachNeighbourRelationHoldsBothWays) {
    const TriMesh sphere = make_sphere(3);
    const auto neighbours = triangle_neighbours(sphere.triangles);
    for (Index t = 0; t < neighbours.size(); ++t)
        for (std::size_t k = 0; k < 3; ++k) {
            ASSERT_NE(neighbours[t][k], kNoIndex);
            const auto& back = neighbours[neighbours[t][k]];
            EXPECT_NE(std::find(back.begin(), back.end(), t), back.end());
        }
    EXPECT_EQ(unique_edges(sphere.triangles).size(), sphere.triangles.size() * 3 / 2);
}

TEST(Adjacency, TrianglesAroundAVertexAreAllOfThem) {
    const TriMesh sphere = make_sphere(2);
    const VertexTriangles around = vertex_triangles(sphere.triangles, sphere.vertices.size());
    std::size_t total = 0;
    for (Index v = 0; v < sphere.vertices.size(); ++v)
        for (const Index t : around.of(v)) {
            const auto& corners = sphere.triangles[t];
            EXPECT_NE(std::find(corners.begin(), corners.end(), v), corners.end());
            ++total;
        }
    EXPECT_EQ(total, 3 * sphere.triangles.size());
}

namespace {
TetMesh make_cube_tets() { // Kuhn's six tets round the diagonal 0-7
    TetMesh m;
    m.vertices = make_cube().vertices;
    m.tets = {{0, 1, 3, 7}, {0, 3, 2, 7}, {0, 2, 6, 7}, {0, 6, 4, 7}, {0, 4, 5, 7}, {0, 5, 1, 7}};
    return m;
}
} // namespace

TEST(TetReport, TheBoundaryOfATetMeshIsClosedAndOutward) {
    const TetMesh tets = make_cube_tets();
    const TetMeshReport report = inspect_tets(tets);
    EXPECT_TRUE(report.valid());
    EXPECT_DOUBLE_EQ(report.volume, 1.0);
    EXPECT_EQ(report.components, 1u);
    const TriMesh surface = boundary_surface(tets);
    EXPECT_EQ(surface.triangles.size(), 12u);
    EXPECT_TRUE(check_closed_surface(surface).ok());
    EXPECT_DOUBLE_EQ(signed_volume(surface), 1.0);
}

TEST(SurfaceReport, CountsThousandsOfComponentsAndOneFanOfTwoHundredTriangles) {
    TriMesh many;
    for (Index k = 0; k < 3000; ++k) {
        const Vec3 corner(10.0 * (k % 15), 10.0 * (k / 15 % 15), 10.0 * (k / 225));
        for (const Vec3& side : {Vec3(0, 0, 0), Vec3(5, 0, 0), Vec3(0, 5, 0), Vec3(0, 0, 5)}) many.vertices.push_back(corner + side);
        const Index v = 4 * k;
        for (const Triangle& t : {Triangle{0, 2, 1}, Triangle{0, 1, 3}, Triangle{1, 2, 3}, Triangle{2, 0, 3}})
            many.triangles.push_back({v + t[0], v + t[1], v + t[2]});
    }
    const SurfaceReport report = inspect_surface(many);
    EXPECT_EQ(report.components, 3000u);
    EXPECT_TRUE(report.closed() && report.manifold() && report.oriented());
    EXPECT_NEAR(report.signed_volume, 3000.0 * 125.0 / 6.0, 1e-6);
    TriMesh bipyramid;
    bipyramid.vertices = {Vec3(0, 0, 20), Vec3(0, 0, -20)};
    for (Index k = 0; k < 200; ++k) {
        const double angle = 0.01 * 3.14159265358979 * k;
        bipyramid.vertices.emplace_back(30.0 * std::cos(angle), 30.0 * std::sin(angle), 0.0);
        const Index a = 2 + k, b = 2 + (k + 1) % 200;
        bipyramid.triangles.push_back({0, a, b});
        bipyramid.triangles.push_back({1, b, a});
    }
    const SurfaceReport fan = inspect_surface(bipyramid);
    EXPECT_EQ(fan.components, 1u);
    EXPECT_TRUE(fan.closed() && fan.manifold() && fan.oriented());
    EXPECT_EQ(vertex_triangles(bipyramid.triangles, bipyramid.vertices.size()).of(0).size(), 200u);
}

TEST(TetReport, CountsEveryDefectByKind) {
    TetMesh tets = make_cube_tets();
    std::swap(tets.tets[2][0], tets.tets[2][1]);
    tets.tets.push_back({0, 1, 2, 3});  // flat: one face of the cube
    tets.tets.push_back({0, 1, 3, 99}); // out of range
    tets.tets.push_back({3, 7, 0, 1});  // the first again
    tets.vertices.emplace_back(9, 9, 9);
    const TetMeshReport report = inspect_tets(tets);
    EXPECT_EQ(report.inverted_tets + report.flat_tets + report.out_of_range_tets, report.inverted_tets + 2u);
    EXPECT_GE(report.inverted_tets, 1u);
    EXPECT_EQ(report.flat_tets, 1u);
    EXPECT_EQ(report.out_of_range_tets, 1u);
    EXPECT_EQ(report.duplicate_tets, 1u);
    EXPECT_EQ(report.unreferenced_nodes, 1u);
    EXPECT_FALSE(report.valid());
    EXPECT_EQ(std::count(report.bad_tets.begin(), report.bad_tets.end(), 2u), 1);
}

/// Soups of parts whose edges, holes and volume are known by how they were made.
TEST(MadeMeshes, ReportsMatchWhatTheyWereMadeOf) {
    for (const std::uint64_t seed : {1u, 2u, 3u, 4u}) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        made::Random random(seed);
        TriMesh whole;
        std::size_t rims = 0, components = 0, triangles = 0;
        double volume = 0.0;
        for (; components < 1 + seed; ++components) {
            TriMesh part = made::make_organ(10 * seed + components, 3);
            for (Vec3& v : part.vertices) v += Vec3(0.3 * static_cast<double>(components), 0, 0);
            volume += signed_volume(part);
            std::size_t rim = 0;
            if (seed % 2 == 0) part = made::with_holes(part, 3, random, &rim);
            rims += rim;
            whole = join(std::move(whole), part);
        }
        triangles = whole.triangles.size();
        TriMesh mesh = made::as_soup(whole, random);
        EXPECT_EQ(inspect_surface(mesh).components, triangles) << "a soup before it is welded";
        ASSERT_TRUE(apply_repair(mesh, Repair::Weld).ok());
        const SurfaceReport report = inspect_surface(mesh);
        EXPECT_EQ(mesh.triangles.size(), triangles);
        EXPECT_EQ(report.boundary_edges, rims);
        EXPECT_EQ(report.nonmanifold_edges, 0u);
        EXPECT_EQ(report.inconsistent_edges, 0u);
        EXPECT_EQ(report.components, components);
        EXPECT_EQ(report.closed(), rims == 0);
        if (rims == 0) {
            EXPECT_NEAR(report.signed_volume, volume, 1e-9 * volume);
        }
    }
}

TEST(RealMeshes, ReportsMatchTheManifest) {
    struct Row {
        const char* name;
        std::size_t boundary, nonmanifold, components;
        double volume;
    };
    for (const Row& row :
         {Row{"vessels/hra_vhf_arteries_101k.obj.gz", 628, 0, 7, 0.0001783},
          Row{"organs/hra_vhf_liver_capsule_30k.obj.gz", 230, 0, 1, 0.001421},
          Row{"organs/hra_vhm_liver_capsule_28k.obj.gz", 0, 0, 1, 7.444e-05}, Row{"cow/spot_23k.obj.gz", 0, 0, 1, 0.688}}) {
        SCOPED_TRACE(row.name);
        TROCAR_LOAD_OR_SKIP(mesh, row.name);
        ASSERT_TRUE(apply_repair(mesh, Repair::Weld).ok()); // the manifest counts welded files
        const SurfaceReport report = inspect_surface(mesh);
        EXPECT_EQ(report.boundary_edges, row.boundary);
        EXPECT_EQ(report.nonmanifold_edges, row.nonmanifold);
        EXPECT_EQ(report.components, row.components);
        if (report.closed()) {
            EXPECT_NEAR(report.signed_volume, row.volume, 1e-3 * row.volume);
        }
    }
}
