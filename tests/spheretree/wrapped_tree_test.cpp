#include "base/repair.hpp"
#include "base/topology.hpp"
#include "shapes.hpp"
#include "spheretree/build/tree_quality.hpp"
#include "spheretree/build/wrapped_tree.hpp"
#include "tests/made/surfaces.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace trocar::spheretree {
namespace {

using test::make_icosphere;
using test::make_straight_tube;
using test::Random;

constexpr Builder kBuilders[] = {Builder::Medial, Builder::Hubbard, Builder::Octree, Builder::Shell};

TriMesh make_box(const Vec3& extent) {
    TriMesh mesh;
    for (int k = 0; k < 8; ++k) mesh.vertices.emplace_back((k & 1) * extent[0], ((k >> 1) & 1) * extent[1], (k >> 2) * extent[2]);
    mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                      {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    return mesh;
}

TriMesh join(TriMesh a, const TriMesh& b) {
    const auto first = static_cast<Index>(a.vertices.size());
    a.vertices.insert(a.vertices.end(), b.vertices.begin(), b.vertices.end());
    for (const Triangle& t : b.triangles) a.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
    return a;
}

/// The invariants, by a measure that takes nothing from the builder, and by random places of the surface.
void expect_wrapped(const TriMesh& mesh, const WrappedOptions& options, std::uint64_t seed) {
    const Result<WrappedTree> built = build_wrapped_tree(mesh, options);
    ASSERT_TRUE(built.ok()) << built.error().to_string();
    const SphereTree& tree = built->tree;
    ASSERT_EQ(tree.level_count(), options.depth + 1U);
    const TreeQuality quality = measure_quality(tree, mesh, needs_closed(options.builder), {1e-4, 16, 64});
    for (const LevelQuality& level : quality.levels) {
        EXPECT_EQ(level.uncovered, 0.0);
        EXPECT_EQ(level.reachable, 1.0);
    }
    Random random(seed);
    for (int k = 0; k < 500; ++k) {
        const auto t = static_cast<std::size_t>(random.uniform(0.0, static_cast<double>(mesh.triangles.size())));
        double u = random.uniform(0, 1), v = random.uniform(0, 1);
        if (u + v > 1.0) std::tie(u, v) = std::pair(1.0 - u, 1.0 - v);
        const Triangle& c = mesh.triangles[t];
        const Vec3 p = mesh.vertices[c[0]] * (1.0 - u - v) + mesh.vertices[c[1]] * u + mesh.vertices[c[2]] * v;
        std::vector<Index> holding{0};
        for (std::size_t level = 0; level < tree.level_count(); ++level) {
            std::vector<Index> next;
            bool held = false;
            for (const Index s : holding) {
                if ((p - tree.spheres[s].centre).norm() > tree.spheres[s].radius * (1.0 + 1e-9)) continue;
                held = true;
                for (Index i = 0; i < tree.child_count[s]; ++i) next.push_back(tree.first_child[s] + i);
            }
            ASSERT_TRUE(held) << "seed " << seed << " level " << level << " triangle " << t;
            holding = std::move(next);
        }
    }
    for (Index s = 0; s < tree.sphere_count(); ++s) EXPECT_LE(tree.child_count[s], std::max(8U, options.branching));
    for (Index s = tree.level_begin[options.depth]; s < tree.sphere_count(); ++s) EXPECT_GT(tree.item_end[s], tree.item_begin[s]);
}

TEST(WrappedTree, EveryLevelHoldsTheSurfaceAndIsReachedWhateverTheBuilder) {
    const TriMesh shapes[] = {make_icosphere(Vec3(1, 2, 3), 0.05, 2), make_straight_tube(0.01, 0.2), make_box(Vec3(0.1, 0.2, 0.3)),
                              make_box(Vec3(0.3, 0.3, 1e-4)),
                              join(make_icosphere(Vec3::Zero(), 0.05, 2), make_icosphere(Vec3(0.3, 0, 0), 0.01, 2))};
    for (std::size_t i = 0; i < std::size(shapes); ++i)
        for (const Builder builder : kBuilders)
            for (const auto& [branching, depth] : {std::pair(8U, 2U), std::pair(3U, 2U)}) {
                SCOPED_TRACE("shape " + std::to_string(i) + " " + std::string(builder_name(builder)) + " " + std::to_string(branching) +
                             "^" + std::to_string(depth));
                expect_wrapped(shapes[i], {builder, builder == Builder::Octree ? 8U : branching, depth}, 17 + i);
            }
}

TEST(WrappedTree, RandomBumpySurfacesAreHeld) {
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
        Random random(seed);
        TriMesh mesh = make_icosphere(Vec3::Zero(), 1.0, 3);
        for (Vec3& v : mesh.vertices) v *= random.uniform(0.85, 1.15);
        const double scale = std::pow(10.0, random.uniform(-9.0, 6.0));
        for (Vec3& v : mesh.vertices) v *= scale;
        for (const Builder builder : {Builder::Medial, Builder::Shell}) {
            SCOPED_TRACE("seed " + std::to_string(seed));
            expect_wrapped(mesh, {builder, 8, 2}, seed);
        }
    }
}

TEST(WrappedTree, OneTriangleAndCoincidentPointsHaveATree) {
    TriMesh one;
    one.vertices = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0)};
    one.triangles = {{0, 1, 2}};
    expect_wrapped(one, {Builder::Shell, 8, 2}, 3);
    expect_wrapped(one, {Builder::Octree, 8, 2}, 3);
    TriMesh point = one;
    point.vertices = {Vec3(1, 1, 1), Vec3(1, 1, 1), Vec3(1, 1, 1)};
    for (const Builder builder : {Builder::Shell, Builder::Octree}) {
        const auto built = build_wrapped_tree(point, {builder, 8, 2});
        ASSERT_TRUE(built.ok());
        for (const Sphere& s : built->tree.spheres) EXPECT_LE((s.centre - Vec3(1, 1, 1)).norm(), s.radius + 1e-12);
    }
}

TEST(WrappedTree, MedialSpheresAreTighterThanTheBaselines) {
    const TriMesh mesh = make_straight_tube(0.01, 0.2, 16, 30);
    double volume[3] = {}, worst[3] = {};
    const Builder builders[] = {Builder::Medial, Builder::Hubbard, Builder::Octree};
    for (int k = 0; k < 3; ++k) {
        const auto built = build_wrapped_tree(mesh, {builders[k], 8, 2});
        ASSERT_TRUE(built.ok());
        const TreeQuality quality = measure_quality(built->tree, mesh, true);
        volume[k] = union_volume(std::span(built->tree.spheres).subspan(built->tree.level_begin[2]), 256) / signed_volume(mesh);
        worst[k] = quality.levels[2].outside_max;
    }
    EXPECT_LT(worst[0], worst[1]);
    EXPECT_LT(worst[0], worst[2]);
    EXPECT_LT(volume[0], volume[1]);
    EXPECT_LT(volume[0], volume[2]);
    EXPECT_GT(volume[0], 1.0);
}

TEST(WrappedTree, SameSurfaceSameBits) {
    const TriMesh mesh = make_straight_tube(0.01, 0.1, 12, 12);
    const auto a = build_wrapped_tree(mesh, {Builder::Medial, 8, 2}), b = build_wrapped_tree(mesh, {Builder::Medial, 8, 2});
    ASSERT_EQ(a->tree.sphere_count(), b->tree.sphere_count());
    for (std::size_t s = 0; s < a->tree.sphere_count(); ++s) {
        EXPECT_EQ(a->tree.spheres[s].centre, b->tree.spheres[s].centre);
        EXPECT_EQ(a->tree.spheres[s].radius, b->tree.spheres[s].radius);
    }
    EXPECT_EQ(a->tree.items, b->tree.items);
}

TEST(WrappedTree, SaysWhichTrianglesAreBadAndWhichBuilderWouldDo) {
    TriMesh open = make_box(Vec3(1, 1, 1));
    open.triangles.pop_back();
    const auto missing = build_wrapped_tree(open, {});
    ASSERT_FALSE(missing.ok());
    EXPECT_EQ(missing.error().code, ErrorCode::BadMesh);
    EXPECT_THAT(missing.error().message, ::testing::HasSubstr("first bad triangles"));
    EXPECT_THAT(missing.error().message, ::testing::HasSubstr("shell"));
    EXPECT_THAT(missing.error().message, ::testing::HasSubstr("fill_holes"));
    EXPECT_TRUE(build_wrapped_tree(open, {Builder::Shell, 8, 1}).ok());
    TriMesh crossing = join(make_icosphere(Vec3::Zero(), 1.0, 2), make_icosphere(Vec3(0.7, 0.2, 0.1), 1.0, 2));
    const auto crossed = build_wrapped_tree(crossing, {});
    ASSERT_FALSE(crossed.ok());
    EXPECT_THAT(crossed.error().message, ::testing::HasSubstr("cross"));
    EXPECT_THAT(crossed.error().message, ::testing::HasSubstr("drop_self_intersections"));
    TriMesh broken = make_box(Vec3(1, 1, 1));
    broken.vertices[3][1] = std::nan("");
    for (const Builder builder : kBuilders) EXPECT_FALSE(build_wrapped_tree(broken, {builder, 8, 1}).ok());
    EXPECT_FALSE(build_wrapped_tree(TriMesh{}, {}).ok());
    EXPECT_FALSE(build_wrapped_tree(make_box(Vec3(1, 1, 1)), {Builder::Medial, 1, 1}).ok());
}

TEST(WrappedTree, ASurfaceWhoseCrossingsAreNotFoundOutIsRefusedByBuildersThatNeedAnInside) {
    const TriMesh shells = join(make_icosphere(Vec3::Zero(), 1.0, 2), make_icosphere(Vec3::Zero(), 0.98, 2));
    EXPECT_TRUE(check_surface_for(shells, Builder::Medial).ok());
    const auto refused = check_surface_for(shells, Builder::Medial, 0);
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::BadMesh);
    EXPECT_THAT(refused.error().message, ::testing::HasSubstr("too near to each other to tell whether any cross"));
    EXPECT_THAT(refused.error().message, ::testing::HasSubstr("shell"));
    EXPECT_TRUE(check_surface_for(shells, Builder::Shell, 0).ok());
}

TEST(WrappedTree, NonManifoldClosedSurfacesWork) {
    // two boxes that share an edge's vertices: four triangles meet there
    TriMesh a = make_box(Vec3(1, 1, 1)), b = make_box(Vec3(1, 1, 1));
    for (Vec3& v : b.vertices) v += Vec3(1, 1, 0);
    TriMesh mesh = join(a, b);
    for (Triangle& t : mesh.triangles)
        for (Index& v : t)
            for (Index w = 0; w < 8; ++w)
                if (v >= 8 && mesh.vertices[v] == mesh.vertices[w]) v = w;
    ASSERT_GT(inspect_surface(mesh).nonmanifold_edges, 0U);
    expect_wrapped(mesh, {Builder::Medial, 8, 2}, 5);
}

TEST(WrappedTree, NeedlesAreCutIntoSoManyPiecesAndNoMore) {
    TriMesh needle = make_box(Vec3(1, 1, 1));
    needle.vertices.back() = Vec3::Constant(1e6);
    for (const Builder builder : {Builder::Octree, Builder::Shell}) {
        SCOPED_TRACE(builder_name(builder));
        const auto built = build_wrapped_tree(needle, {builder, 8, 1});
        ASSERT_TRUE(built.ok());
        EXPECT_LT(built->pieces.size(), 700'000U);
        std::size_t outside = 0;
        for (Index s = built->tree.level_begin[1]; s < built->tree.level_begin[2]; ++s)
            for (Index k = built->tree.item_begin[s]; k < built->tree.item_end[s]; ++k)
                for (const Index corner : built->pieces[k].corners)
                    outside +=
                        (built->set.point(corner) - built->tree.spheres[s].centre).norm() > built->tree.spheres[s].radius * (1 + 1e-12);
        EXPECT_EQ(outside, 0U);
        EXPECT_EQ(built->coarser, builder == Builder::Shell);
    }
    EXPECT_FALSE(build_wrapped_tree(make_straight_tube(0.001, 0.5), {Builder::Medial, 8, 2})->coarser);
}

TEST(WrappedTree, MadeOrgansAnimalsAndArteriesAreHeld) {
    for (const TriMesh& mesh : {made::make_organ(1, 4), made::make_animal(1, 2000), made::make_artery_tree(1, 4000)}) {
        SCOPED_TRACE(mesh.triangles.size());
        expect_wrapped(mesh, {Builder::Medial, 8, 2}, 11);
    }
}

TEST(WrappedTree, ClosedOrgansOfTheTestDataAreHeld) {
    std::size_t seen = 0;
    for (const char* name : {"organs/sofa_liver.obj", "organs/sofa_liver2.obj", "stanford/armadillo_1k_sofa.obj",
                             "vessels/steve_vessel_architecture_3.6k.obj"}) {
        auto mesh = test::read_test_obj(name, 1.0);
        if (!mesh) continue;
        SCOPED_TRACE(name);
        ASSERT_TRUE(apply_repair(*mesh, Repair::Weld).ok());
        expect_wrapped(*mesh, {Builder::Medial, 8, 2}, 11);
        ++seen;
    }
    if (seen == 0) GTEST_SKIP() << "TROCAR_TEST_DATA does not name the test data";
}

TEST(TreeQuality, SeesWhatIsMissing) {
    constexpr QualityOptions kCoarse{1e-3, 32, 64};
    const TriMesh mesh = make_straight_tube(0.01, 0.2);
    SphereTree tree = build_wrapped_tree(mesh, {Builder::Medial, 8, 1})->tree;
    const double before = measure_quality(tree, mesh, true, kCoarse).levels[1].outside_max;
    tree.spheres[1].radius *= 0.5;
    EXPECT_GT(measure_quality(tree, mesh, true, kCoarse).levels[1].uncovered, 0.01);
    EXPECT_LT(measure_quality(tree, mesh, true, kCoarse).levels[1].reachable, 0.99);
    tree.spheres[1].radius *= 4.0;
    EXPECT_EQ(measure_quality(tree, mesh, true, kCoarse).levels[1].uncovered, 0.0);
    EXPECT_GT(measure_quality(tree, mesh, true, kCoarse).levels[1].outside_max, before);
}

TEST(TreeQuality, VolumeOfAUnionCountsOverlapsOnce) {
    const Sphere ball{Vec3(1, 2, 3), 0.5};
    const double one = 4.0 / 3.0 * 3.14159265358979 * 0.125;
    EXPECT_NEAR(union_volume(std::vector<Sphere>{ball, ball}, 256), one, 0.002 * one);
    EXPECT_NEAR(union_volume(std::vector<Sphere>{ball, {Vec3(3, 2, 3), 0.5}}, 512), 2 * one, 0.004 * one);
    EXPECT_EQ(union_volume(std::vector<Sphere>{{Vec3::Zero(), -1.0}}, 16), 0.0);
}

} // namespace
} // namespace trocar::spheretree
