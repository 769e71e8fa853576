// Surfaces as seen from afar: fewer triangles on their own vertices, still closed, still in place.
#include "engine/viewer/far_triangles.hpp"

#include "base/triangle_tree.hpp"
#include "tests/base/test_meshes.hpp"

#include <map>

namespace trocar::engine::viewer {
namespace {

using test::flipped;
using test::join;
using test::make_sphere;
using test::make_torus;

/// m, of the far surface from the whole one, at the middles of its triangles and of their edges.
double farthest_off(const TriMesh& whole, const std::vector<Triangle>& far) {
    const TriangleTree tree(whole);
    double farthest = 0.0;
    for (const Triangle& t : far)
        for (const Vec3& weights : {Vec3(1, 1, 1), Vec3(1, 1, 0), Vec3(0, 1, 1), Vec3(1, 0, 1)}) {
            const Vec3 p =
                (weights[0] * whole.vertices[t[0]] + weights[1] * whole.vertices[t[1]] + weights[2] * whole.vertices[t[2]]) / weights.sum();
            farthest = std::max(farthest, tree.closest(p)->distance);
        }
    return farthest;
}

void expect_closed(const std::vector<Triangle>& triangles) {
    std::map<std::pair<Index, Index>, int> edges;
    for (const Triangle& t : triangles)
        for (int k = 0; k < 3; ++k) ++edges[{t[k], t[(k + 1) % 3]}];
    for (const auto& [edge, count] : edges) {
        const auto back = edges.find({edge.second, edge.first});
        ASSERT_TRUE(back != edges.end() && back->second == count) << edge.first << ", " << edge.second;
    }
}

TEST(FarTriangles, AreFewOnTheSurfacesOwnVerticesAndCloseIt) {
    const TriMesh sphere = make_sphere(5), torus = make_torus(96, 48);
    for (const TriMesh* mesh : {&sphere, &torus})
        for (const std::size_t wanted : {std::size_t{400}, std::size_t{1500}}) {
            const std::vector<Triangle> far = far_triangles(*mesh, wanted);
            ASSERT_GT(far.size(), wanted / 2);
            EXPECT_LE(far.size(), wanted);
            for (const Triangle& t : far)
                for (const Index vertex : t) ASSERT_LT(vertex, mesh->vertices.size());
            expect_closed(far);
            EXPECT_LT(farthest_off(*mesh, far), wanted == 400 ? 0.06 : 0.02); // of a radius of 1, a tube of 0.3
        }
}

TEST(FarTriangles, AreNoneWhereThereAreFewAnyway) {
    const TriMesh sphere = make_sphere(2);
    EXPECT_TRUE(far_triangles(sphere, sphere.triangles.size()).empty());
    EXPECT_TRUE(far_triangles({}, 10).empty());
}

TEST(FarTriangles, AreNoneOfWhatCannotBeSimplified) {
    TriMesh fan; // three sheets at one edge
    fan.vertices = {Vec3(0, 0, 0), Vec3(0, 0, 1), Vec3(1, 0, 0), Vec3(-1, 0, 0), Vec3(0, 1, 0)};
    fan.triangles = {{0, 1, 2}, {0, 1, 3}, {0, 1, 4}};
    EXPECT_TRUE(far_triangles(fan, 2).empty());
    TriMesh bad = make_sphere(3);
    bad.vertices[7].x() = std::numeric_limits<double>::quiet_NaN();
    EXPECT_TRUE(far_triangles(bad, 50).empty());
}

TEST(FarTriangles, OfShellsInOneMeshKeepThemApart) {
    const TriMesh both = join(make_sphere(4), flipped(make_sphere(4, 0.5)));
    const std::vector<Triangle> far = far_triangles(both, 600);
    ASSERT_FALSE(far.empty());
    expect_closed(far);
    const auto outer = static_cast<Index>(both.vertices.size() / 2);
    for (const Triangle& t : far) EXPECT_TRUE((t[0] < outer) == (t[1] < outer) && (t[1] < outer) == (t[2] < outer));
}

} // namespace
} // namespace trocar::engine::viewer
