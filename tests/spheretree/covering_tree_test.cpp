#include "shapes.hpp"
#include "spheretree/bounding.hpp"
#include "spheretree/update/chain_tree.hpp"
#include "spheretree/update/covering_tree.hpp"
#include "tests/made/surfaces.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace trocar::spheretree {
namespace {

using test::make_icosphere;
using test::make_straight_tube;
using test::Random;

void expect_sound_layout(const SphereTree& tree, std::size_t items) {
    ASSERT_EQ(tree.items.size(), items);
    std::vector<int> seen(items, 0);
    std::size_t reached = 1;
    for (Index s = 0; s < tree.sphere_count(); ++s) {
        EXPECT_GE(s, tree.level_begin[tree.level[s]]);
        EXPECT_LT(s, tree.level_begin[tree.level[s] + 1U]);
        if (tree.is_leaf(s)) {
            for (const Index item : tree.items_of(s)) ++seen[item];
            continue;
        }
        Index next = tree.item_begin[s];
        for (Index c = tree.first_child[s]; c < tree.first_child[s] + tree.child_count[s]; ++c, ++reached) {
            EXPECT_EQ(tree.parent[c], s);
            EXPECT_EQ(tree.item_begin[c], next);
            next = tree.item_end[c];
        }
        EXPECT_EQ(next, tree.item_end[s]);
    }
    EXPECT_EQ(reached, tree.sphere_count()) << "every sphere is a child of one sphere";
    for (const int n : seen) EXPECT_EQ(n, 1);
}

/// Every sphere holds every triangle beneath it: then each level, with the leaves above it, covers the whole surface.
void expect_covers(const CoveringTree& covering, std::span<const Sphere> spheres, const TriMesh& mesh, std::span<const Vec3> position) {
    for (Index s = 0; s < covering.tree.sphere_count(); ++s)
        for (const Index t : covering.tree.items_of(s))
            for (const Index v : mesh.triangles[t])
                ASSERT_LE((position[v] - spheres[s].centre).norm(), spheres[s].radius) << "sphere " << s << " triangle " << t;
}

TEST(CoveringTree, EveryLevelCoversTheWholeSurface) {
    for (const TriMesh& mesh : {make_icosphere({1, 2, 3}, 0.05, 3), make_straight_tube(3e-3, 0.1)}) {
        const CoveringTree covering = build_covering_tree(mesh);
        expect_sound_layout(covering.tree, mesh.triangles.size());
        expect_covers(covering, covering.tree.spheres, mesh, mesh.vertices);
    }
}

TEST(CoveringTree, OfMadeVesselsAndClothCoversThem) {
    for (const TriMesh& mesh : {made::make_artery_tree(2, 4000), made::make_overlapping_arteries(2), made::make_drape(30, 0.5)}) {
        const CoveringTree covering = build_covering_tree(mesh, {.branching = 4, .leaf_triangles = 3});
        expect_sound_layout(covering.tree, mesh.triangles.size());
        expect_covers(covering, covering.tree.spheres, mesh, mesh.vertices);
    }
}

TEST(CoveringTree, OfAPatientsVesselsCoversThem) {
    const auto mesh = test::read_test_obj("vessels/steve_vessel_architecture_3.6k.obj", 1e-3);
    if (!mesh) GTEST_SKIP() << "TROCAR_TEST_DATA does not name a folder with the test data";
    const CoveringTree covering = build_covering_tree(*mesh, {.branching = 4, .leaf_triangles = 3});
    expect_sound_layout(covering.tree, mesh->triangles.size());
    expect_covers(covering, covering.tree.spheres, *mesh, mesh->vertices);
}

TEST(CoveringTree, UpdatedSpheresHoldTheSurfaceAllAlongTheStep) {
    const TriMesh mesh = make_icosphere(Vec3::Zero(), 0.05, 3);
    const CoveringTree covering = build_covering_tree(mesh);
    std::vector<Vec3> t0, t1;
    for (const Vec3& v : mesh.vertices) {
        t0.emplace_back(1.3 * v[0], v[1] + 4.0 * v[0] * v[0], v[2]);
        t1.emplace_back(v[1] + 0.01, v[0] - 3.0 * v[2] * v[2], -0.5 * v[2]);
    }
    std::vector<Sphere> spheres;
    update_covering_spheres(covering, t0, t1, spheres);
    for (const double t : {0.0, 0.3, 0.5, 0.77, 1.0}) {
        std::vector<Vec3> now;
        for (std::size_t v = 0; v < t0.size(); ++v) now.emplace_back((1 - t) * t0[v] + t * t1[v]);
        expect_covers(covering, spheres, mesh, now);
    }
}

TEST(CoveringTree, IsTightOnASphere) {
    const TriMesh mesh = make_icosphere(Vec3::Zero(), 1.0, 4);
    const CoveringTree covering = build_covering_tree(mesh);
    EXPECT_LT(covering.tree.spheres[0].radius, 1.05);
    for (Index s = 0; s < covering.tree.sphere_count(); ++s)
        if (covering.tree.is_leaf(s)) {
            EXPECT_LT(covering.tree.spheres[s].radius, 0.2);
        }
}

TEST(CoveringTree, OfNothingIsEmptyAndOfNaNHoldsTheRest) {
    EXPECT_EQ(build_covering_tree({}).tree.sphere_count(), 0U);
    TriMesh mesh = make_icosphere(Vec3::Zero(), 1.0, 1);
    mesh.vertices[0][1] = std::nan("");
    const CoveringTree covering = build_covering_tree(mesh);
    for (Index s = 0; s < covering.tree.sphere_count(); ++s)
        for (const Index t : covering.tree.items_of(s))
            for (const Index v : mesh.triangles[t])
                if (v != 0) {
                    EXPECT_LE((mesh.vertices[v] - covering.tree.spheres[s].centre).norm(), covering.tree.spheres[s].radius);
                }
}

TEST(Bounding, EnclosesRandomBallsWithinAFewPerCent) {
    const std::uint64_t seed = 11;
    SCOPED_TRACE(::testing::Message() << "seed " << seed);
    Random random(seed);
    for (int round = 0; round < 50; ++round) {
        std::vector<Sphere> balls;
        for (int i = 0; i < 20; ++i) {
            const Vec3 centre = random.in_box({Vec3(-1, -1, -1), Vec3(1, 1, 1)});
            balls.push_back({centre, random.uniform(0.0, 0.3)});
        }
        const Sphere few = enclose(balls), many = enclose(balls, 4000);
        for (const Sphere& b : balls) EXPECT_LE((b.centre - few.centre).norm() + b.radius, few.radius);
        EXPECT_LT(few.radius, 1.05 * many.radius);
    }
}

TEST(ChainTree, LeavesSweepTheirLinksAndGroupsHoldThem) {
    const ChainTree chain = make_chain_tree(100);
    expect_sound_layout(chain.tree, 100);
    std::vector<Sphere> t0, t1;
    for (int i = 0; i < 77; ++i) {
        t0.push_back({Vec3(i * 1e-3, 0, 0), 5e-4});
        t1.push_back({Vec3(i * 1e-3, 1e-5 * i * i, 2e-3), 6e-4});
    }
    ChainState state;
    update_chain(chain, t0, t1, state);
    for (Index s = 0; s < chain.tree.sphere_count(); ++s) {
        const auto links = chain.tree.items_of(s);
        if (links.front() >= 77) {
            EXPECT_LT(state.spheres[s].radius, 0.0) << "no active link beneath sphere " << s;
            continue;
        }
        for (const Index link : links) {
            if (link >= 77) continue;
            for (const Sphere& end : {t0[link], t1[link]})
                EXPECT_LE((end.centre - state.spheres[s].centre).norm() + end.radius, state.spheres[s].radius * (1 + 1e-12));
        }
    }
    for (Index link = 0; link < 100; ++link) {
        EXPECT_TRUE(chain.tree.is_leaf(chain.leaf_of_link(link)));
        EXPECT_EQ(chain.link_of_leaf(chain.leaf_of_link(link)), link);
    }
}

} // namespace
} // namespace trocar::spheretree
