#include "base/self_intersection.hpp"
#include "collision/culling/cull_twin.hpp"
#include "collision/culling/cullide.hpp"
#include "collision/culling/image_space.hpp"
#include "shapes.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace trocar::collision {
namespace {

using testing::Random;

std::vector<TrianglePair> crossings_by_tree(const std::vector<Triangle>& triangles, const std::vector<Vec3>& positions) {
    std::vector<TrianglePair> pairs;
    for (const auto& [a, b] : find_self_intersections({positions, triangles}).pairs) pairs.push_back({a, b});
    return pairs;
}

std::vector<TrianglePair> crossings_by_image_space(const std::vector<Triangle>& triangles, const std::vector<Vec3>& positions,
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
                for (const bool patches : {false, true})
                    EXPECT_EQ(
                        crossings_by_image_space(soup.triangles, soup.t0, {.memory = memory, .resolution = resolution, .patches = patches}),
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
    std::size_t flat_left = 0;
    EXPECT_EQ(crossings_by_image_space(tube.triangles, tube.t0, {.resolution = 500, .patches = false}, &flat_left), truth);
    EXPECT_EQ(crossings_by_image_space(tube.triangles, tube.t0, {.resolution = 500}, &left), truth);
    std::printf("crossing tubes: %zu triangles of %zu left, %zu without patches, %zu crossings\n", left, tube.triangles.size(), flat_left,
                truth.size());
    EXPECT_LT(flat_left, tube.triangles.size() / 2);
    EXPECT_LE(left, flat_left);
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
    EXPECT_TRUE(crossings_by_image_space(triangles, positions, {.resolution = 500}, &left).empty());
    EXPECT_EQ(left, 0u);
}

TEST(ImageSpace, EdgeOnAndSubPixelTrianglesAreNotPrunedWhileTheyCross) {
    // a plate seen edge-on along two axes, pierced by a needle far thinner than a pixel; a big triangle far away makes pixels coarse
    const std::vector<Vec3> positions = {{0, 0, 0},        {1, 0, 0},           {0, 1, 0},
                                         {0.3, 0.3, -0.5}, {0.3, 0.3, 0.5},     {0.3 + 1e-9, 0.3, 0.5},
                                         {1e4, 1e4, 1e4},  {1e4 + 1, 1e4, 1e4}, {1e4, 1e4 + 1, 1e4}};
    const std::vector<Triangle> triangles = {{0, 1, 2}, {3, 4, 5}, {6, 7, 8}};
    for (const int resolution : {2, 100, 512})
        EXPECT_EQ(crossings_by_image_space(triangles, positions, {.resolution = resolution}), (std::vector<TrianglePair>{{0, 1}}));
}

TEST(ImageSpace, NothingAndNotANumberAreNoTrap) {
    EXPECT_TRUE(crossings_by_image_space({}, {}, {}).empty());
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const std::vector<Vec3> positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {nan, 0.3, -0.5}, {0.3, 0.3, 0.5}, {0.4, 0.3, 0.5}};
    EXPECT_TRUE(crossings_by_image_space({{0, 1, 2}, {3, 4, 5}}, positions, {}).empty());
    EXPECT_TRUE(crossings_by_image_space({{0, 0, 0}, {1, 1, 2}}, positions, {}).empty());
}

struct TwoTubes {
    std::vector<Triangle> triangles;
    std::vector<Vec3> positions;
    TwoTubes() {
        const auto tube = testing::make_bent_tube(1.0, 0.08, 60, 24, 2.0), other = testing::make_bent_tube(1.0, 0.07, 50, 20, -1.0);
        positions = tube.t0;
        triangles = tube.triangles;
        const auto shift = static_cast<Index>(positions.size());
        for (const Vec3& p : other.t0) positions.push_back(p + Vec3(0.03, 0.1, 0.2));
        for (const Triangle& t : other.triangles) triangles.push_back({t[0] + shift, t[1] + shift, t[2] + shift});
    }
};

TEST(ImageSpace, ViewsThatPrunedMostComeFirstNextTimeAndLoseNothing) {
    const TwoTubes tubes;
    ImageSpaceCuller culler(tubes.triangles, tubes.positions.size());
    CpuCullBackend twin;
    const auto truth = crossings_by_tree(tubes.triangles, tubes.positions);
    std::size_t first_pass_left[2];
    for (std::size_t& left : first_pass_left) {
        const auto ids = culler.find_colliding_set(tubes.positions, {.resolution = 300, .patches = false}, twin);
        ASSERT_TRUE(ids.ok());
        EXPECT_EQ(find_crossings(tubes.triangles, tubes.positions, *ids), truth);
        left = culler.passes().front().triangles_left;
    }
    EXPECT_LE(first_pass_left[1], first_pass_left[0]);
}

TEST(ImageSpace, ACallerWithAClockDecidesWhenTheCpuTakesOver) {
    const TwoTubes tubes;
    ImageSpaceCuller culler(tubes.triangles, tubes.positions.size());
    CpuCullBackend twin;
    for (const std::size_t wanted : {3u, 5u}) {
        std::size_t asked = 0;
        ImageSpacePlan plan{.resolution = 200, .patches = false, .coherent_views = false};
        plan.go_on = [&](const ImageSpacePass& pass) {
            EXPECT_GE(pass.triangles, pass.triangles_left);
            ++asked;
            return culler.passes().size() < wanted;
        };
        ASSERT_TRUE(culler.find_colliding_set(tubes.positions, plan, twin).ok());
        EXPECT_EQ(culler.passes().size(), wanted);
        EXPECT_EQ(asked, wanted - 2);
    }
}

/// A sheet of squares, height by place.
template <class Height>
testing::Surface make_sheet(Index side, Height&& height) {
    testing::Surface s;
    for (Index y = 0; y <= side; ++y)
        for (Index x = 0; x <= side; ++x) s.t0.emplace_back(x, y, height(static_cast<double>(x), static_cast<double>(y)));
    for (Index y = 0; y < side; ++y)
        for (Index x = 0; x < side; ++x) {
            const Index a = (side + 1) * y + x;
            s.triangles.push_back({a, a + 1, a + side + 1});
            s.triangles.push_back({a + 1, a + side + 2, a + side + 1});
        }
    return s;
}

void add(testing::Surface& to, const testing::Surface& from, const Vec3& shift) {
    const auto first = static_cast<Index>(to.t0.size());
    for (const Vec3& p : from.t0) to.t0.push_back(p + shift);
    for (const Triangle& t : from.triangles) to.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
}

TEST(ImageSpacePatches, WholePatchesOfASmoothSheetGoFirst) {
    const auto sheet = make_sheet(60, [](double x, double y) { return 2.0 * std::sin(0.1 * x) * std::cos(0.07 * y); });
    ImageSpaceCuller culler(sheet.triangles, sheet.t0.size());
    CpuCullBackend twin;
    const auto left = culler.find_colliding_set(sheet.t0, {.resolution = 300}, twin);
    ASSERT_TRUE(left.ok());
    EXPECT_TRUE(left->empty());
    std::size_t by_patches = 0;
    for (const ImageSpacePass& pass : culler.passes()) {
        EXPECT_LE(pass.asking, pass.patches);
        EXPECT_LE(pass.triangles_left, pass.triangles);
        if (pass.patches > 0) by_patches += pass.triangles - pass.triangles_left;
    }
    std::printf("patches pruned %zu of %zu triangles\n", by_patches, sheet.triangles.size());
    EXPECT_GT(by_patches, sheet.triangles.size() / 4);
}

/// Sheets that penetrate each other by less and less: a crossing far below a pixel is kept, in the middle of
/// patches that are as smooth as can be.
TEST(ImageSpacePatches, ASmoothSheetThatDipsThroughAnotherByNextToNothingIsKept) {
    for (const double dip : {1.0, 1e-3, 1e-6, 1e-9}) {
        auto sheets = make_sheet(40, [](double, double) { return 0.0; });
        const auto other = make_sheet(40, [&](double x, double y) { return x == 20.0 && y == 20.0 ? -dip : 0.5; });
        add(sheets, other, Vec3(0.3, 0.3, 0.0));
        const auto truth = crossings_by_tree(sheets.triangles, sheets.t0);
        ASSERT_FALSE(truth.empty());
        for (const int resolution : {7, 64, 500}) {
            std::size_t left = 0;
            EXPECT_EQ(crossings_by_image_space(sheets.triangles, sheets.t0, {.resolution = resolution}, &left), truth) << dip;
            if (resolution == 500) {
                EXPECT_LT(left, sheets.triangles.size() / 4) << "and little else";
            }
        }
    }
}

/// All faces of a ramp that winds twice around its axis are turned up, and it lies over itself: the normals alone prove nothing.
TEST(ImageSpacePatches, ARampThatWindsOverItselfAndCrossesIsKept) {
    constexpr Index kAround = 80, kAcross = 6;
    for (const double rise : {0.002, 0.0, -0.002}) { // per turn; every second turn is tilted through the one below it
        testing::Surface ramp;
        for (Index i = 0; i <= 2 * kAround; ++i)
            for (Index k = 0; k <= kAcross; ++k) {
                const double turn = 2.0 * 3.14159265358979 * i / kAround, radius = 1.0 + 0.1 * k;
                const double tilt = 0.01 * (static_cast<double>(k) - 0.5 * kAcross) * std::cos(0.5 * turn);
                ramp.t0.emplace_back(radius * std::cos(turn), radius * std::sin(turn), rise * turn + tilt);
            }
        for (Index i = 0; i < 2 * kAround; ++i)
            for (Index k = 0; k < kAcross; ++k) {
                const Index a = i * (kAcross + 1) + k, b = a + kAcross + 1;
                ramp.triangles.push_back({a, a + 1, b});
                ramp.triangles.push_back({a + 1, b + 1, b});
            }
        const auto truth = crossings_by_tree(ramp.triangles, ramp.t0);
        EXPECT_FALSE(truth.empty()) << rise;
        EXPECT_EQ(crossings_by_image_space(ramp.triangles, ramp.t0, {.resolution = 400}), truth) << rise;
    }
}

/// Many triangles at one vertex, sheets that share an edge of three faces, faces turned the other way, twice the same triangle.
TEST(ImageSpacePatches, WhatIsNoManifoldIsNoTrap) {
    auto mesh = make_sheet(24, [](double x, double) { return 0.2 * std::sin(x); });
    add(mesh, make_sheet(24, [](double, double y) { return 0.3 * y - 3.0; }), Vec3(0.4, 0.2, 0.0));
    const auto hub = static_cast<Index>(mesh.t0.size());
    mesh.t0.emplace_back(12.0, 12.0, 6.0);
    for (Index k = 0; k < 500; ++k) mesh.triangles.push_back({hub, k % hub, (k * 7 + 3) % hub});
    for (Index k = 0; k < 40; ++k) mesh.triangles.push_back(mesh.triangles[11 * k]);
    for (Index k = 0; k < 200; ++k) std::swap(mesh.triangles[3 * k][0], mesh.triangles[3 * k][1]);
    mesh.triangles.push_back({5, 5, 9});
    const auto truth = crossings_by_tree(mesh.triangles, mesh.t0);
    EXPECT_GT(truth.size(), 100u);
    for (const CullMemory memory : {CullMemory::Fronts, CullMemory::Intervals})
        for (const int resolution : {31, 256})
            EXPECT_EQ(crossings_by_image_space(mesh.triangles, mesh.t0, {.memory = memory, .resolution = resolution}), truth);
}

TEST(ImageSpacePatches, TheFootprintOfAHullHoldsEveryPointOfIt) {
    Random random(5);
    for (int trial = 0; trial < 300; ++trial) {
        const Vec3 squeeze(random.real(0.0, 1.0), trial % 3 == 0 ? 1e-9 : 1.0, trial % 5 == 0 ? 0.0 : 1.0);
        std::vector<Vec3> points;
        const Vec3 centre = random.vector(1.0);
        for (std::size_t k = 0; k < 1 + random.bits() % 20; ++k) points.push_back(centre + random.vector(0.4).cwiseProduct(squeeze));
        std::vector<Vec3> all = points;
        for (int k = 0; k < 5; ++k) all.push_back(random.vector(2.0));
        const int size = 1 + static_cast<int>(random.bits() % 200);
        const CullFrame f = make_cull_frame(view_along(random.vector(1.0) + Vec3(1e-3, 0, 0)), all, 0.0, size, size);
        const Vec3 normal = trial % 7 == 0 ? Vec3(Vec3::Zero()) : trial % 2 == 0 ? f.view.forward : random.vector(1.0);
        const Footprint p = make_footprint(f, points, normal);
        for (int k = 0; k < 50; ++k) {
            Vec3 x = Vec3::Zero();
            double sum = 0.0;
            for (const Vec3& corner : points) {
                const double weight = k < 20 ? random.real(0.0, 1.0) : std::pow(random.real(0.0, 1.0), 40.0) + 1e-300;
                x += weight * corner;
                sum += weight;
            }
            x /= sum;
            const double px = (f.view.right.dot(x) - f.left) * f.pixels_x, py = (f.view.up.dot(x) - f.bottom) * f.pixels_y,
                         depth = (f.view.forward.dot(x) - f.nearest) * f.depth_scale;
            const auto u = static_cast<float>(std::floor(px) - p.x0), v = static_cast<float>(std::floor(py) - p.y0);
            ASSERT_TRUE(u >= 0.0f && v >= 0.0f && u < static_cast<float>(p.x1 - p.x0) && v < static_cast<float>(p.y1 - p.y0)) << trial;
            ASSERT_TRUE(covers(p, u, v)) << trial;
            const DepthInterval d = depths(p, u, v);
            ASSERT_TRUE(d.front <= depth && depth <= d.back) << trial;
        }
    }
}

TEST(PatchHierarchy, HoldsEveryTriangleOnceAndPatchesOfAConnectedMeshAreFew) {
    const TwoTubes tubes;
    const PatchHierarchy h = make_patch_hierarchy(tubes.triangles, tubes.positions.size());
    std::vector<Index> sorted = h.order;
    std::sort(sorted.begin(), sorted.end());
    for (Index t = 0; t < sorted.size(); ++t) ASSERT_EQ(sorted[t], t);
    EXPECT_EQ(sorted.size(), tubes.triangles.size());
    EXPECT_EQ(h.patches.size(), 2 * tubes.triangles.size() - 1);
    std::size_t pieces = 0, patches = 0;
    for (const auto& patch : h.patches) {
        ASSERT_LT(patch.begin, patch.end);
        if (patch.left == kNoIndex) {
            ASSERT_EQ(patch.end - patch.begin, 1u);
            continue;
        }
        const auto &l = h.patches[patch.left], &r = h.patches[patch.left + 1];
        ASSERT_TRUE(l.begin == patch.begin && l.end == r.begin && r.end == patch.end);
        std::vector<Index> left(h.order.begin() + patch.begin, h.order.begin() + patch.end);
        ++patches;
        while (!left.empty()) { // pieces by brute force over shared vertices
            ++pieces;
            std::vector<Index> piece{left.back()};
            left.pop_back();
            for (std::size_t k = 0; k < piece.size() && !left.empty(); ++k)
                for (std::size_t i = 0; i < left.size();)
                    if (are_adjacent(tubes.triangles[piece[k]], tubes.triangles[left[i]])) {
                        piece.push_back(left[i]);
                        left[i] = left.back();
                        left.pop_back();
                    } else {
                        ++i;
                    }
        }
    }
    std::printf("%zu patches in %zu pieces\n", patches, pieces);
    EXPECT_LT(static_cast<double>(pieces), 1.2 * static_cast<double>(patches));
    EXPECT_TRUE(make_patch_hierarchy({}, 0).patches.empty());
    EXPECT_EQ(make_patch_hierarchy(std::vector<Triangle>{{0, 0, 0}}, 1).patches.size(), 1u);
}

TEST(Cullide, FindsWhatPenetratesAndAConnectedHierarchyDrawsLessThanARandomOne) {
    const TwoTubes tubes;
    const auto truth = crossings_by_tree(tubes.triangles, tubes.positions);
    std::size_t queries[2];
    for (const bool random : {false, true}) {
        Cullide cullide(tubes.triangles, random ? make_random_hierarchy(tubes.triangles.size(), 7)
                                                : make_patch_hierarchy(tubes.triangles, tubes.positions.size()));
        const auto ids = cullide.find_colliding_set(tubes.positions, {.resolution = 500});
        queries[random] = 0;
        for (const CullidePass& pass : cullide.passes()) queries[random] += pass.queries;
        const auto found = find_crossings(tubes.triangles, tubes.positions, ids);
        std::printf("%s: %zu triangles of %zu left, %zu of %zu crossings, %zu passes, %zu queries\n", random ? "random" : "connected",
                    ids.size(), tubes.triangles.size(), found.size(), truth.size(), cullide.passes().size(), queries[random]);
        EXPECT_LT(ids.size(), tubes.triangles.size() / 2);
        EXPECT_GT(static_cast<double>(found.size()), 0.5 * static_cast<double>(truth.size()));
        EXPECT_TRUE(std::ranges::includes(truth, found,
                                          [](const TrianglePair& x, const TrianglePair& y) { return x.a != y.a ? x.a < y.a : x.b < y.b; }));
    }
    EXPECT_LT(queries[0], queries[1]);
}

TEST(Cullide, LosesWhatThePaperSaysItLosesAndTheConservativeFormDoesNot) {
    // a needle thinner than a pixel through a plate
    const std::vector<Vec3> positions = {{0, 0, 0},         {1, 0, 0},      {0, 1, 0},     {0.3, 0.3, -0.5}, {0.3, 0.3, 0.5},
                                         {0.301, 0.3, 0.5}, {-20, -20, -1}, {20, -20, -1}, {0, 20, -1}};
    const std::vector<Triangle> triangles = {{0, 1, 2}, {3, 4, 5}, {6, 7, 8}};
    Cullide cullide(triangles, make_patch_hierarchy(triangles, positions.size()));
    const auto ids = cullide.find_colliding_set(positions, {.resolution = 50});
    EXPECT_TRUE(find_crossings(triangles, positions, ids).empty());
    EXPECT_EQ(crossings_by_image_space(triangles, positions, {.resolution = 50}), (std::vector<TrianglePair>{{0, 1}}));
    Cullide nothing({}, make_patch_hierarchy({}, 0));
    EXPECT_TRUE(nothing.find_colliding_set({}, {}).empty());
}

} // namespace
} // namespace trocar::collision
