#include "base/repair.hpp"
#include "base/self_intersection.hpp"

#include "test_meshes.hpp"

using namespace seldinger;
using namespace seldinger::test;

namespace {
using Corners = std::array<Vec3, 3>;
const Corners kFloor{Vec3(0, 0, 0), Vec3(4, 0, 0), Vec3(0, 4, 0)};
bool proper(const Corners& other) { return triangles_cross(kFloor, other, Crossing::Proper); }
bool touching(const Corners& other) { return triangles_cross(kFloor, other, Crossing::Touching); }
} // namespace

TEST(TrianglesCross, TellsCrossingFromTouchingFromApart) {
    const Corners through{Vec3(1, 1, -1), Vec3(1, 1, 1), Vec3(9, 9, 0.5)};
    EXPECT_TRUE(proper(through) && touching(through));
    const Corners tip_on{Vec3(1, 1, 0), Vec3(1, 2, 1), Vec3(2, 1, 1)};
    EXPECT_TRUE(!proper(tip_on) && touching(tip_on));
    const Corners tip_above{Vec3(1, 1, 1e-300), Vec3(1, 2, 1), Vec3(2, 1, 1)};
    EXPECT_TRUE(!proper(tip_above));
    const Corners flat_overlap{Vec3(1, 1, 0), Vec3(5, 1, 0), Vec3(1, 5, 0)};
    EXPECT_TRUE(!proper(flat_overlap) && touching(flat_overlap));
    const Corners flat_inside{Vec3(1, 1, 0), Vec3(1.5, 1, 0), Vec3(1, 1.5, 0)};
    EXPECT_TRUE(!proper(flat_inside) && touching(flat_inside));
    const Corners flat_apart{Vec3(5, 5, 0), Vec3(6, 5, 0), Vec3(5, 6, 0)};
    EXPECT_FALSE(touching(flat_apart));
    const Corners beside{Vec3(3, 3, -1), Vec3(3, 3, 1), Vec3(4, 4, 0)};
    EXPECT_FALSE(proper(beside) || touching(beside));
    const Corners needle_through{Vec3(1, 1, -1), Vec3(1, 1, 1), Vec3(1, 1, 2)};
    EXPECT_TRUE(touching(needle_through));
    const Corners needle_apart{Vec3(1, 1, 1), Vec3(1, 1, 2), Vec3(1, 1, 3)};
    EXPECT_FALSE(touching(needle_apart));
}

TEST(TrianglesCross, AnswersAlikeForEveryOrderOfCornersAndTriangles) {
    Random random{51};
    SCOPED_TRACE(random.trace());
    int crossing = 0;
    for (int trial = 0; trial < 20000; ++trial) {
        Corners a{random.point(), random.point(), random.point()}, b{random.point(), random.point(), random.point()};
        for (Corners* t : {&a, &b})
            for (Vec3& v : *t) v = (v * 3.0).array().round(); // a small lattice: many coplanar and touching pairs
        for (const Crossing kind : {Crossing::Proper, Crossing::Touching}) {
            const bool answer = triangles_cross(a, b, kind);
            EXPECT_EQ(triangles_cross(b, a, kind), answer);
            EXPECT_EQ(triangles_cross({a[1], a[2], a[0]}, {b[1], b[0], b[2]}, kind), answer);
            EXPECT_EQ(triangles_cross({a[1], a[0], a[2]}, {b[2], b[0], b[1]}, kind), answer);
        }
        EXPECT_LE(triangles_cross(a, b, Crossing::Proper), triangles_cross(a, b, Crossing::Touching));
        crossing += triangles_cross(a, b, Crossing::Proper);
    }
    EXPECT_GT(crossing, 100);
}

TEST(SelfIntersections, TwoSpheresCrossAndOneDoesNot) {
    EXPECT_EQ(find_self_intersections(make_sphere(4)).count, 0u);
    const TriMesh two = join(make_sphere(3), make_sphere(3, 1.0, Vec3(0.7, 0.1, 0.2)));
    const SelfIntersections all = find_self_intersections(two);
    EXPECT_GT(all.count, 20u);
    EXPECT_EQ(all.pairs.size(), all.count);
    EXPECT_TRUE(std::is_sorted(all.pairs.begin(), all.pairs.end()));
    std::size_t brute = 0;
    for (Index a = 0; a < two.triangles.size(); ++a)
        for (Index b = a + 1; b < two.triangles.size(); ++b) {
            const auto corners = [&](Index t) {
                return Corners{two.vertices[two.triangles[t][0]], two.vertices[two.triangles[t][1]], two.vertices[two.triangles[t][2]]};
            };
            const bool shared = std::any_of(two.triangles[a].begin(), two.triangles[a].end(),
                                            [&](Index v) { return std::count(two.triangles[b].begin(), two.triangles[b].end(), v) > 0; });
            brute += !shared && triangles_cross(corners(a), corners(b), Crossing::Proper);
        }
    EXPECT_EQ(all.count, brute);
    const SelfIntersections few = find_self_intersections(two, 3);
    EXPECT_EQ(few.pairs.size(), 3u);
    EXPECT_EQ(few.count, all.count);
}

TEST(SelfIntersections, CubesFaceToFaceTouchButDoNotCross) {
    const TriMesh two = join(make_cube(), make_cube(1.0, Vec3(1, 0, 0)));
    EXPECT_EQ(find_self_intersections(two).count, 0u);
    EXPECT_GT(find_self_intersections(two, 100, Crossing::Touching).count, 0u);
}

TEST(SelfIntersections, RealMeshesHaveTheManifestsCounts) {
    for (const auto& [name, count] : {std::pair{"vessels/hra_vhf_arteries_101k.obj.gz", 91u},
                                      std::pair{"cow/cow_viewpoint_5.8k.obj.gz", 75u}, std::pair{"cow/spot_23k.obj.gz", 0u},
                                      std::pair{"organs/sofa_liver-smooth.obj", 5u}, std::pair{"stanford/armadillo_25k_sofa.obj.gz", 1u}}) {
        SCOPED_TRACE(name);
        SELDINGER_LOAD_OR_SKIP(mesh, name);
        ASSERT_TRUE(apply_repair(mesh, Repair::Weld, {.weld_tolerance = 1e-12 * mesh.bounds().longest_edge()}).ok());
        EXPECT_EQ(find_self_intersections(mesh).count, count);
    }
}
