// Edges that are sharp: of polyhedra in any attitude all of them, of a curved surface in facets none.
#include "engine/prepare/sharp_edges.hpp"

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace trocar::engine {
namespace {

constexpr unsigned kSharpSeed = 7;

/// A prism over a polygon in the xy plane, from z = 0 to its height; each side of it is `rows` quads high.
TriMesh make_sharp_prism(const std::vector<Vec3>& polygon, double height, Index rows, const std::vector<Triangle>& cap) {
    TriMesh mesh;
    const auto n = static_cast<Index>(polygon.size());
    for (Index row = 0; row <= rows; ++row)
        for (const Vec3& p : polygon) mesh.vertices.push_back(p + Vec3(0.0, 0.0, height * row / rows));
    for (Index row = 0; row < rows; ++row)
        for (Index i = 0; i < n; ++i) {
            const Index a = row * n + i, b = row * n + (i + 1) % n;
            mesh.triangles.push_back({a, b, b + n});
            mesh.triangles.push_back({a, b + n, a + n});
        }
    for (const Triangle& t : cap) {
        mesh.triangles.push_back({t[0], t[2], t[1]});
        mesh.triangles.push_back({rows * n + t[0], rows * n + t[1], rows * n + t[2]});
    }
    return mesh;
}

TriMesh turned(TriMesh mesh, std::mt19937& engine) {
    std::normal_distribution<double> normal;
    const Eigen::Quaterniond turn = Eigen::Quaterniond(normal(engine), normal(engine), normal(engine), normal(engine)).normalized();
    const Vec3 shift(normal(engine), normal(engine), normal(engine));
    for (Vec3& v : mesh.vertices) v = turn * v + shift;
    return mesh;
}

std::size_t count_sharp_edges(const TriMesh& surface) {
    return find_sharp_edges(surface, collision::make_topology(surface.triangles, surface.vertices.size())).size();
}

TEST(SharpEdges, OfPrismsAreThoseOfTheirCapsAndSidesAndConvexAlone) {
    std::mt19937 engine(kSharpSeed);
    const std::vector<Vec3> square{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    const std::vector<Vec3> ell{{0, 0, 0}, {2, 0, 0}, {2, 1, 0}, {1, 1, 0}, {1, 2, 0}, {0, 2, 0}};
    for (Index rows = 1; rows < 5; ++rows) {
        const TriMesh box = turned(make_sharp_prism(square, 1.5, rows, {{0, 1, 2}, {0, 2, 3}}), engine);
        EXPECT_EQ(count_sharp_edges(box), 8u + 4u * rows);
        const TriMesh bent = turned(make_sharp_prism(ell, 1.0, rows, {{0, 1, 2}, {0, 2, 3}, {0, 3, 5}, {3, 4, 5}}), engine);
        EXPECT_EQ(count_sharp_edges(bent), 12u + 5u * rows) << "without the one that is a crease";
    }
}

TEST(SharpEdges, OfATubeOfManySidesAreItsRims) {
    std::mt19937 engine(kSharpSeed);
    for (const Index sides : {20u, 33u, 64u}) {
        std::vector<Vec3> circle;
        std::vector<Triangle> cap;
        for (Index i = 0; i < sides; ++i) circle.emplace_back(std::cos(6.283185307179586 * i / sides), std::sin(6.283185307179586 * i / sides), 0.0);
        for (Index i = 1; i + 1 < sides; ++i) cap.push_back({0, i, i + 1});
        const TriMesh tube = turned(make_sharp_prism(circle, 3.0, 4, cap), engine);
        EXPECT_EQ(count_sharp_edges(tube), 2u * sides);
    }
}

} // namespace
} // namespace trocar::engine
