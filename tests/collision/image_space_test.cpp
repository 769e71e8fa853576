#include "base/self_intersection.hpp"
#include "collision/cull_twin.hpp"
#include "collision/image_space.hpp"
#include "shapes.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace seldinger::collision {
namespace {

using testing::Random;

std::vector<TrianglePair> crossings_by_tree(const std::vector<Triangle>& triangles, const std::vector<Vec3>& positions) {
    std::vector<TrianglePair> pairs;
    for (const auto& [a, b] : find_self_intersections({positions, triangles}).pairs) pairs.push_back({a, b});
    return pairs;
}

std::vector<TrianglePair> crossings_by_pictures(const std::vector<Triangle>& triangles, const std::vector<Vec3>& positions,
                                                const ImageSpacePlan& plan, std::size_t* left = nullptr) {
    ImageSpaceCuller culler(triangles, positions.size());
    CpuCullBackend twin;
    const auto ids = culler.find_colliding_set(positions, plan, twin);
    EXPECT_TRUE(ids.ok());
    if (left) *left = ids->size();
    return find_crossings(triangles, positions, *ids);
}

TEST(ImageSpace, NoCrossingOfATriangleSoupIsLostAtAnyResolution) {
    Random random(21);
    for (const int resolution : {1, 3, 64, 301})
        for (const double size : {0.02, 0.1, 0.4}) {
            const auto soup = testing::make_triangle_soup(random, 300, 1.0, size, 0.0);
            SCOPED_TRACE(::testing::Message() << "seed 21, resolution " << resolution << ", size " << size);
            for (const CullMemory memory : {CullMemory::Fronts, CullMemory::Intervals})
                EXPECT_EQ(crossings_by_pictures(soup.triangles, soup.t0, {.memory = memory, .resolution = resolution}),
                          crossings_by_tree(soup.triangles, soup.t0));
        }
}

TEST(ImageSpace, TubesThatCrossKeepTheirCrossingsAndLittleElse) {
    auto tube = testing::make_bent_tube(1.0, 0.08, 80, 32, 2.0);
    const auto other = testing::make_bent_tube(1.0, 0.07, 70, 30, -1.0);
    const auto shift = static_cast<Index>(tube.t0.size());
    for (const Vec3& p : other.t0) tube.t0.push_back(p + Vec3(0.03, 0.1, 0.2));
    for (const Triangle& t : other.triangles) tube.triangles.push_back({t[0] + shift, t[1] + shift, t[2] + shift});
    const auto truth = crossings_by_tree(tube.triangles, tube.t0);
    EXPECT_GT(truth.size(), 50u);
    std::size_t left = 0;
    EXPECT_EQ(crossings_by_pictures(tube.triangles, tube.t0, {.resolution = 500}, &left), truth);
    std::printf("crossing tubes: %zu triangles of %zu left, %zu crossings\n", left, tube.triangles.size(), truth.size());
    EXPECT_LT(left, tube.triangles.size() / 2);
}

TEST(ImageSpace, ASheetWithoutAFoldIsPrunedWhole) {
    std::vector<Vec3> positions;
    std::vector<Triangle> triangles;
    for (int y = 0; y <= 20; ++y)
        for (int x = 0; x <= 20; ++x) positions.emplace_back(x, y, 0.3 * std::sin(0.4 * x));
    for (Index y = 0; y < 20; ++y)
        for (Index x = 0; x < 20; ++x) {
            const Index a = 21 * y + x;
            triangles.push_back({a, a + 1, a + 21});
            triangles.push_back({a + 1, a + 22, a + 21});
        }
    std::size_t left = 1;
    EXPECT_TRUE(crossings_by_pictures(triangles, positions, {.resolution = 500}, &left).empty());
    EXPECT_EQ(left, 0u);
}

TEST(ImageSpace, EdgeOnAndSubPixelTrianglesAreNotPrunedWhileTheyCross) {
    // a plate seen edge-on along two axes, pierced by a needle far thinner than a pixel; a big triangle far away makes pixels coarse
    const std::vector<Vec3> positions = {{0, 0, 0},        {1, 0, 0},           {0, 1, 0},
                                         {0.3, 0.3, -0.5}, {0.3, 0.3, 0.5},     {0.3 + 1e-9, 0.3, 0.5},
                                         {1e4, 1e4, 1e4},  {1e4 + 1, 1e4, 1e4}, {1e4, 1e4 + 1, 1e4}};
    const std::vector<Triangle> triangles = {{0, 1, 2}, {3, 4, 5}, {6, 7, 8}};
    for (const int resolution : {2, 100, 512})
        EXPECT_EQ(crossings_by_pictures(triangles, positions, {.resolution = resolution}), (std::vector<TrianglePair>{{0, 1}}));
}

TEST(ImageSpace, NothingAndNotANumberAreNoTrap) {
    EXPECT_TRUE(crossings_by_pictures({}, {}, {}).empty());
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const std::vector<Vec3> positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {nan, 0.3, -0.5}, {0.3, 0.3, 0.5}, {0.4, 0.3, 0.5}};
    EXPECT_TRUE(crossings_by_pictures({{0, 1, 2}, {3, 4, 5}}, positions, {}).empty());
    EXPECT_TRUE(crossings_by_pictures({{0, 0, 0}, {1, 1, 2}}, positions, {}).empty());
}

} // namespace
} // namespace seldinger::collision
