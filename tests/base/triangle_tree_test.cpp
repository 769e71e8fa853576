#include "base/inside.hpp"
#include "base/repair.hpp"
#include "base/triangle_tree.hpp"

#include "test_meshes.hpp"
#include "tests/made/surfaces.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

using namespace trocar;
using namespace trocar::test;

TEST(TriangleTree, ClosestPointEqualsBruteForceBeforeAndAfterARefit) {
    Random random{11};
    SCOPED_TRACE(random.trace());
    TriMesh mesh = make_torus(24, 12);
    TriangleTree tree(mesh);
    for (int round = 0; round < 2; ++round) {
        for (int trial = 0; trial < 200; ++trial) {
            const Vec3 p = random.point(1.6);
            double least_sq = std::numeric_limits<double>::infinity();
            for (const Triangle& t : mesh.triangles)
                least_sq =
                    std::min(least_sq, closest_on_triangle(p, mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]).distance_sq);
            const auto hit = tree.closest(p);
            ASSERT_TRUE(hit);
            EXPECT_EQ(hit->distance, std::sqrt(least_sq));
            EXPECT_FALSE(tree.closest(p, 0.999 * hit->distance));
            EXPECT_TRUE(tree.closest(p, 1.001 * hit->distance));
        }
        for (Vec3& v : mesh.vertices) v += 0.1 * random.point();
        tree.refit(mesh.vertices);
    }
}

/// On a regular surface many triangles are equally near: to points above its vertices and edges, and in its middle.
TEST(TriangleTree, OfEquallyNearTrianglesTheLowestIsFoundWhateverBoundsTheSearch) {
    Random random{12};
    SCOPED_TRACE(random.trace());
    for (TriMesh mesh : {make_sphere(3), make_torus(24, 12), make_cube()}) {
        std::shuffle(mesh.triangles.begin(), mesh.triangles.end(), random.engine);
        const TriangleTree tree(mesh);
        for (int trial = 0; trial < 600; ++trial) {
            const Triangle& above = mesh.triangles[static_cast<std::size_t>(trial) % mesh.triangles.size()];
            const Vec3& v = mesh.vertices[above[0]];
            const Vec3 p = trial % 3 == 0   ? Vec3(1.3 * v)
                           : trial % 3 == 1 ? Vec3(0.45 * (v + mesh.vertices[above[1]]))
                                            : Vec3(v + 1e-9 * random.point());
            Index lowest = kNoIndex;
            double least_sq = std::numeric_limits<double>::infinity();
            for (Index t = 0; t < mesh.triangles.size(); ++t) {
                const Triangle& c = mesh.triangles[t];
                const double distance_sq = closest_on_triangle(p, mesh.vertices[c[0]], mesh.vertices[c[1]], mesh.vertices[c[2]]).distance_sq;
                if (distance_sq < least_sq) least_sq = distance_sq, lowest = t;
            }
            for (const double bound : {std::numeric_limits<double>::infinity(), std::sqrt(least_sq) + 1e-9, 2.0 * std::sqrt(least_sq) + 1e-9}) {
                const auto hit = tree.closest(p, bound);
                ASSERT_TRUE(hit) << trial;
                EXPECT_EQ(hit->triangle, lowest) << trial << " within " << bound;
            }
        }
    }
}

TEST(TriangleTree, OverlapsEqualBruteForce) {
    Random random{12};
    SCOPED_TRACE(random.trace());
    const TriMesh mesh = make_torus(24, 12);
    const TriangleTree tree(mesh);
    for (int trial = 0; trial < 100; ++trial) {
        Box3 box;
        box.add(random.point(1.3));
        box.inflate(random.uniform(0.0, 0.4));
        std::set<Index> expected, found;
        for (Index t = 0; t < mesh.triangles.size(); ++t) {
            Box3 own;
            for (const Index v : mesh.triangles[t]) own.add(mesh.vertices[v]);
            if (own.overlaps(box)) expected.insert(t);
        }
        tree.for_each_overlapping(box, [&](Index t) { EXPECT_TRUE(found.insert(t).second); });
        EXPECT_EQ(found, expected);
    }
}

TEST(TriangleTree, NonFiniteVerticesAndQueriesFindNothingFalse) {
    TriMesh mesh = make_sphere(2);
    mesh.vertices[3][1] = std::nan("");
    mesh.vertices[7][0] = std::numeric_limits<double>::infinity();
    const TriangleTree tree(mesh);
    const auto hit = tree.closest(Vec3(2, 2, 2));
    ASSERT_TRUE(hit);
    EXPECT_TRUE(is_finite(hit->point));
    EXPECT_FALSE(tree.closest(Vec3(std::nan(""), 0, 0)));
    EXPECT_FALSE(TriangleTree().closest(Vec3::Zero()));
}

TEST(InsideTest, KnowsASphereFromItsRadius) {
    Random random{13};
    SCOPED_TRACE(random.trace());
    const TriMesh sphere = make_sphere(4);
    const InsideTest test(sphere);
    for (int trial = 0; trial < 3000; ++trial) {
        const Vec3 p = random.point(1.2);
        const double r = p.norm();
        if (r > 0.985 && r < 1.0) continue; // between the facets and the sphere
        EXPECT_EQ(test.winding_number(p), r < 1.0 ? 1 : 0) << p.transpose();
    }
    EXPECT_NEAR(test.signed_distance(Vec3::Zero()), -1.0, 5e-3);
    EXPECT_NEAR(test.signed_distance(Vec3(3, 0, 0)), 2.0, 1e-12);
}

TEST(InsideTest, RaysThroughVerticesAndEdgesCountOnce) {
    const InsideTest test(make_cube(1.0)); // rays along axes meet edges, diagonals and corners exactly
    for (int i = 0; i <= 16; ++i)
        for (int j = 0; j <= 16; ++j)
            for (int k = 0; k <= 16; ++k) {
                const Vec3 p = Vec3(i, j, k) / 8.0 - Vec3::Constant(0.5);
                const bool strictly_in = p.minCoeff() > 0.0 && p.maxCoeff() < 1.0;
                const bool strictly_out = p.minCoeff() < 0.0 || p.maxCoeff() > 1.0;
                for (int axis = 0; axis < 3; ++axis)
                    for (const bool positive : {false, true}) {
                        const int winding = test.tree().ray_crossings(p, axis, positive);
                        EXPECT_GE(winding, strictly_in ? 1 : 0) << p.transpose() << " axis " << axis;
                        EXPECT_LE(winding, strictly_out ? 0 : 1) << p.transpose() << " axis " << axis;
                    }
            }
}

TEST(InsideTest, AllSixRaysAgreeOnAClosedSurface) {
    Random random{14};
    SCOPED_TRACE(random.trace());
    TriMesh mesh = make_torus(17, 9);
    for (Vec3& v : mesh.vertices) v = (v * 8.0).array().round() / 8.0; // many coordinates in common
    const TriangleTree tree(mesh);
    for (int trial = 0; trial < 3000; ++trial) {
        const Vec3 p = (random.point(1.4) * 16.0).array().round() / 16.0;
        if (tree.closest(p)->distance < 1e-12) continue; // on the surface each ray has its own answer
        std::set<int> windings;
        for (int axis = 0; axis < 3; ++axis)
            for (const bool positive : {false, true}) windings.insert(tree.ray_crossings(p, axis, positive));
        EXPECT_EQ(windings.size(), 1u) << p.transpose();
    }
}

TEST(InsideTest, OverlappingShellsAreOneBodyAndCavitiesAreOutside) {
    const InsideTest overlapping(join(make_sphere(3), make_sphere(3, 1.0, Vec3(0.5, 0, 0))));
    EXPECT_EQ(overlapping.winding_number(Vec3(0.25, 0, 0)), 2);
    EXPECT_TRUE(overlapping.inside(Vec3(-0.7, 0, 0)));
    EXPECT_FALSE(overlapping.inside(Vec3(1.6, 0, 0)));
    const InsideTest hollow(join(make_sphere(3), flipped(make_sphere(3, 0.5))));
    EXPECT_FALSE(hollow.inside(Vec3(0.1, 0, 0)));
    EXPECT_TRUE(hollow.inside(Vec3(0.7, 0, 0)));
}

/// Of tubes whose axes and radii are known the number of tubes around a point is, too.
TEST(InsideTest, CountsTheTubesOfMadeArteriesThatOverlap) {
    for (const std::uint64_t seed : {1u, 2u, 3u}) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        const std::vector<made::Tube> tubes = made::make_tubes(seed);
        const InsideTest test(made::make_overlapping_arteries(seed, 48));
        const Box3 box = made::make_overlapping_arteries(seed, 8).bounds();
        Random random{static_cast<std::uint32_t>(seed)};
        std::size_t inside = 0, shared = 0;
        for (int trial = 0; trial < 20000; ++trial) {
            Vec3 p = box.lo + (0.5 * (random.point() + Vec3::Ones())).cwiseProduct(box.extent());
            if (trial % 2 == 0) { // most of the box is empty: near an axis
                const made::Tube& tube = tubes[static_cast<std::size_t>(trial) / 2 % tubes.size()];
                p = tube.from + 0.5 * (random.uniform() + 1.0) * (tube.to - tube.from) + 1.3 * tube.radius * random.point();
            }
            int around = 0;
            bool in_doubt = false; // between the polygon and the circle around it
            for (const made::Tube& tube : tubes) {
                const Vec3 way = tube.to - tube.from;
                const double share = std::clamp((p - tube.from).dot(way) / way.squaredNorm(), 0.0, 1.0);
                const double depth = (p - tube.from - share * way).norm() / tube.radius;
                around += depth < 1.0;
                in_doubt = in_doubt || (depth > 0.98 && depth < 1.001);
            }
            if (in_doubt) continue;
            const int winding = test.winding_number(p);
            EXPECT_EQ(winding, around) << p.transpose();
            for (int axis = 0; axis < 3; ++axis) EXPECT_EQ(test.tree().ray_crossings(p, axis, trial % 2 == 0), winding) << p.transpose();
            inside += winding > 0;
            shared += winding > 1;
        }
        EXPECT_GT(inside, 2000u);
        EXPECT_GT(shared, 100u) << "tubes overlap";
    }
}

TEST(InsideTest, WorksOnRealArteriesWhoseTubesOverlap) {
    TROCAR_LOAD_OR_SKIP(mesh, "vessels/hra_vhf_arteries_101k.obj.gz");
    ASSERT_TRUE(apply_repairs(mesh, std::array{Repair::Weld, Repair::FillHoles, Repair::Orient}).ok());
    const InsideTest test(mesh);
    Random random{15};
    SCOPED_TRACE(random.trace());
    const Box3 box = mesh.bounds();
    std::size_t inside = 0;
    for (int trial = 0; trial < 20000; ++trial) {
        const Vec3 p = box.lo + (0.5 * (random.point() + Vec3::Ones())).cwiseProduct(box.extent());
        const int winding = test.winding_number(p);
        inside += winding != 0;
        for (int axis = 0; axis < 3; ++axis) EXPECT_EQ(test.tree().ray_crossings(p, axis, trial % 2 == 0), winding) << p.transpose();
    }
    EXPECT_GT(inside, 100u);
    for (std::size_t t = 0; t < mesh.triangles.size(); t += 97) { // a hair inside the wall and outside it
        const auto& [i, j, k] = mesh.triangles[t];
        const Vec3 &a = mesh.vertices[i], &b = mesh.vertices[j], &c = mesh.vertices[k];
        const Vec3 normal = (b - a).cross(c - a).normalized(), middle = (a + b + c) / 3.0;
        EXPECT_EQ(test.winding_number(middle - 1e-9 * normal) - test.winding_number(middle + 1e-9 * normal), 1) << t;
    }
}

TEST(InsideTest, FollowsMovedVertices) {
    TriMesh sphere = make_sphere(3);
    InsideTest test(sphere);
    for (Vec3& v : sphere.vertices) v += Vec3(5, 0, 0);
    test.refit(sphere.vertices);
    EXPECT_TRUE(test.inside(Vec3(5, 0, 0)));
    EXPECT_FALSE(test.inside(Vec3(0, 0, 0)));
}
