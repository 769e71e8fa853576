#include "base/repair.hpp"
#include "base/self_intersection.hpp"
#include "base/triangle_tree.hpp"

#include "test_meshes.hpp"
#include "tests/made/surfaces.hpp"

using namespace trocar;
using namespace trocar::test;

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

TEST(SelfIntersections, PassingOverFansLosesNoPair) {
    Random random{97};
    SCOPED_TRACE(random.trace());
    for (int run = 0; run < 20; ++run) {
        TriMesh mesh; // fans of many triangles on one vertex, through one another
        for (int fan = 0; fan < 3; ++fan) {
            const auto hub = static_cast<Index>(mesh.vertices.size());
            const Vec3 centre = random.point(0.3), across = random.point(), up = across.cross(random.point());
            mesh.vertices.push_back(centre);
            for (int i = 0; i < 40; ++i) mesh.vertices.emplace_back(centre + std::cos(0.15 * i) * across + std::sin(0.15 * i) * up);
            for (Index i = 1; i < 40; ++i) mesh.triangles.push_back({hub, hub + i, hub + i + 1});
        }
        TriangleTree tree(mesh);
        tree.find_common_vertices();
        for (const Triangle& t : mesh.triangles) {
            Box3 box;
            for (const Index v : t) box.add(mesh.vertices[v]);
            std::vector<Index> apart, all_apart;
            tree.for_each_overlapping_apart(box, t, [&](Index other) { apart.push_back(other); });
            tree.for_each_overlapping(box, [&](Index other) {
                const Triangle& o = mesh.triangles[other];
                if (std::none_of(o.begin(), o.end(), [&](Index v) { return v == t[0] || v == t[1] || v == t[2]; }))
                    all_apart.push_back(other);
            });
            std::sort(apart.begin(), apart.end());
            std::sort(all_apart.begin(), all_apart.end());
            ASSERT_EQ(apart, all_apart);
        }
    }
}

TEST(SelfIntersections, AFanOfTwoHundredThousandTrianglesIsComparedWithItselfInOneGlance) {
    constexpr Index kCorners = 200'000; // 20 thousand million pairs of boxes overlap
    TriMesh polygon;
    for (Index i = 0; i < kCorners; ++i)
        polygon.vertices.emplace_back(std::cos(2.0 * M_PI * i / kCorners), std::sin(2.0 * M_PI * i / kCorners), 0.0);
    for (Index i = 2; i < kCorners; ++i) polygon.triangles.push_back({0, i - 1, i});
    TriangleTree tree(polygon);
    tree.find_common_vertices();
    std::size_t visited = 0;
    tree.for_each_overlapping_apart(polygon.bounds(), polygon.triangles[7], [&visited](Index) { ++visited; });
    EXPECT_EQ(visited, 0u);
    EXPECT_EQ(find_self_intersections(polygon).count, 0u);
}

TEST(SelfIntersections, ASearchThatWouldNeverEndGivesUpAndSaysSo) {
    const TriMesh two = join(make_sphere(3), make_sphere(3, 1.0, Vec3(0.3, 0.2, 0.1)));
    const SelfIntersections all = find_self_intersections(two), some = find_self_intersections(two, 10, Crossing::Proper, 500);
    EXPECT_TRUE(all.complete);
    EXPECT_FALSE(some.complete);
    EXPECT_LT(some.count, all.count);
    TriMesh coin; // a polygon closed by a fan round its centre: all needles lie upon each other
    constexpr Index kCorners = 3000;
    for (Index i = 0; i < kCorners; ++i)
        coin.vertices.emplace_back(std::cos(2.0 * M_PI * i / kCorners), std::sin(2.0 * M_PI * i / kCorners), 0.0);
    for (Index i = 2; i < kCorners; ++i) coin.triangles.push_back({0, i - 1, i});
    ASSERT_TRUE(apply_repair(coin, Repair::FillHoles).ok());
    EXPECT_FALSE(find_self_intersections(coin, 0, Crossing::Proper, 10'000).complete);
}

TEST(SelfIntersections, CubesFaceToFaceTouchButDoNotCross) {
    const TriMesh two = join(make_cube(), make_cube(1.0, Vec3(1, 0, 0)));
    EXPECT_EQ(find_self_intersections(two).count, 0u);
    EXPECT_GT(find_self_intersections(two, 100, Crossing::Touching).count, 0u);
}

TEST(SelfIntersections, MadeMeshesHaveAsManyAsBruteForceFinds) {
    std::size_t crossing = 0;
    for (const std::uint64_t seed : {1u, 2u})
        for (const TriMesh& mesh : {made::make_organ(seed, 3), made::make_overlapping_arteries(seed, 12),
                                    made::make_artery_tree(seed, 1500), made::make_drape(20, 0.5 * static_cast<double>(seed))}) {
            const auto corners = [&](Index t) {
                const Triangle& c = mesh.triangles[t];
                return Corners{mesh.vertices[c[0]], mesh.vertices[c[1]], mesh.vertices[c[2]]};
            };
            std::vector<std::array<Index, 2>> brute;
            for (Index a = 0; a < mesh.triangles.size(); ++a)
                for (Index b = a + 1; b < mesh.triangles.size(); ++b) {
                    const Triangle &s = mesh.triangles[a], &t = mesh.triangles[b];
                    const bool shared = std::any_of(s.begin(), s.end(), [&](Index v) { return std::count(t.begin(), t.end(), v) > 0; });
                    if (!shared && triangles_cross(corners(a), corners(b), Crossing::Proper)) brute.push_back({a, b});
                }
            const SelfIntersections found = find_self_intersections(mesh, 1'000'000);
            EXPECT_EQ(found.count, brute.size()) << "seed " << seed;
            EXPECT_TRUE(std::ranges::equal(found.pairs, brute, [](const auto& f, const auto& g) { return f[0] == g[0] && f[1] == g[1]; }));
            crossing += !brute.empty();
        }
    EXPECT_GE(crossing, 2u) << "arteries that overlap cross";
}

TEST(SelfIntersections, RealMeshesHaveTheManifestsCounts) {
    for (const auto& [name, count] : {std::pair{"vessels/hra_vhf_arteries_101k.obj.gz", 91u},
                                      std::pair{"cow/cow_viewpoint_5.8k.obj.gz", 75u}, std::pair{"cow/spot_23k.obj.gz", 0u},
                                      std::pair{"organs/sofa_liver-smooth.obj", 5u}, std::pair{"stanford/armadillo_25k_sofa.obj.gz", 1u}}) {
        SCOPED_TRACE(name);
        TROCAR_LOAD_OR_SKIP(mesh, name);
        ASSERT_TRUE(apply_repair(mesh, Repair::Weld, {.weld_tolerance = 1e-12 * mesh.bounds().longest_edge()}).ok());
        EXPECT_EQ(find_self_intersections(mesh).count, count);
    }
}
