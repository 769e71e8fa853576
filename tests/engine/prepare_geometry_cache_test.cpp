#include "engine/prepare/geometry_cache.hpp"

#include "assets/anatomy/vessels.hpp"
#include "engine/prepare/cache.hpp"
#include "spheretree/lumen/build_lumen.hpp"
#include "tests/engine/private_cache.hpp"

#include <fstream>
#include <gtest/gtest.h>
#include <random>
#include <tuple>

namespace trocar::engine {

namespace {

constexpr std::size_t kTriangles = 1'500;
constexpr double kBlend = 1e-3;

/// A trunk of some 40 mm and a branch that leaves it near its middle.
std::vector<anatomy::VesselBranch> make_branches(std::mt19937_64& random) {
    std::uniform_real_distribution<double> off(-4e-3, 4e-3), radius(1.5e-3, 3e-3);
    const auto near = [&](double z) { return Vec3(off(random), off(random), z); };
    const Vec3 fork = near(20e-3);
    return {{{near(0.0), fork, near(40e-3)}, {radius(random), radius(random), radius(random)}},
            {{fork, fork + Vec3(12e-3, off(random), 6e-3)}, {radius(random), radius(random)}}};
}

/// Every member by name: this does not compile once there is one more.
auto members(const spheretree::LumenTree& lumen) {
    const auto& [tree, largest, leaf, neighbour_begin, neighbours, wall_begin, wall, anchor_begin, anchors, weights, reach, rest, triangles] =
        lumen;
    return std::tie(largest, leaf, neighbour_begin, neighbours, wall_begin, wall, anchor_begin, anchors, weights, reach, rest, triangles);
}

auto members(const spheretree::SphereTree& tree) {
    const auto& [spheres, parent, first_child, child_count, level, level_begin, items, item_begin, item_end] = tree;
    return std::tie(parent, first_child, child_count, level, level_begin, items, item_begin, item_end);
}

void expect_same(const spheretree::LumenTree& a, const spheretree::LumenTree& b) {
    EXPECT_TRUE(members(a) == members(b));
    EXPECT_TRUE(members(a.tree) == members(b.tree));
    ASSERT_EQ(a.tree.spheres.size(), b.tree.spheres.size());
    for (std::size_t i = 0; i < a.tree.spheres.size(); ++i) {
        EXPECT_EQ(a.tree.spheres[i].centre, b.tree.spheres[i].centre);
        EXPECT_EQ(a.tree.spheres[i].radius, b.tree.spheres[i].radius);
    }
}

void cut_in_half(const std::filesystem::path& file) { std::filesystem::resize_file(file, std::filesystem::file_size(file) / 2); }

} // namespace

TEST(GeometryCache, WhatIsReadIsWhatIsMadeBitForBit) {
    std::mt19937_64 random(7);
    for (int round = 0; round < 3; ++round) {
        const PrivateCache cache;
        const auto branches = make_branches(random);
        const Vec3 root = branches[0].axis[0] + Vec3(0.0, 0.0, 2e-3);
        const TriMesh mesh = anatomy::make_vessels(branches, kBlend, kTriangles).value();
        const spheretree::LumenTree lumen = spheretree::build_lumen_tree(mesh).value();
        const spheretree::CentrelineTree line = spheretree::find_centreline_tree(lumen, root).value();
        for (const char* time : {"made", "read", "made again from half an entry"}) {
            SCOPED_TRACE(time);
            const TriMesh kept = make_or_read_vessels(branches, kBlend, kTriangles).value();
            EXPECT_EQ(kept.vertices, mesh.vertices);
            EXPECT_EQ(kept.triangles, mesh.triangles);
            const spheretree::LumenTree kept_lumen = make_or_read_lumen_tree(mesh).value();
            expect_same(kept_lumen, lumen);
            const spheretree::CentrelineTree kept_line = make_or_read_centreline(kept_lumen, root).value();
            EXPECT_EQ(kept_line.points, line.points);
            EXPECT_EQ(kept_line.radii, line.radii);
            EXPECT_EQ(kept_line.parents, line.parents);
            ASSERT_EQ(cache.entries().size(), 3u);
            if (std::string_view(time) == "read")
                for (const auto& entry : cache.entries()) cut_in_half(entry);
        }
    }
}

TEST(GeometryCache, WhateverNumberChangesIsAnotherEntry) {
    const PrivateCache cache;
    std::mt19937_64 random(11);
    auto branches = make_branches(random);
    std::size_t entries = 0;
    const auto expect_new = [&](double blend, std::size_t triangles) {
        ASSERT_TRUE(make_or_read_vessels(branches, blend, triangles).ok());
        EXPECT_EQ(cache.entries().size(), ++entries);
    };
    expect_new(kBlend, kTriangles);
    expect_new(1.1 * kBlend, kTriangles);
    expect_new(kBlend, kTriangles + 100);
    branches[1].axis[1].y() += 1e-6;
    expect_new(kBlend, kTriangles);
    branches[0].radii[2] *= 1.01;
    expect_new(kBlend, kTriangles);
    std::swap(branches[0], branches[1]);
    expect_new(kBlend, kTriangles);
}

TEST(GeometryCache, KeepsNoErrors) {
    const PrivateCache cache;
    const std::vector<anatomy::VesselBranch> bad = {{{Vec3::Zero(), Vec3::Zero()}, {1e-3, 1e-3}}};
    for (int time = 0; time < 2; ++time) EXPECT_FALSE(make_or_read_vessels(bad, kBlend, kTriangles).ok());
    TriMesh open = anatomy::make_vessels(std::vector<anatomy::VesselBranch>{{{Vec3::Zero(), Vec3(0, 0, 20e-3)}, {2e-3, 2e-3}}}, kBlend, 500).value();
    open.triangles.pop_back();
    for (int time = 0; time < 2; ++time) EXPECT_FALSE(make_or_read_lumen_tree(open).ok());
    EXPECT_TRUE(cache.entries().empty());
}

} // namespace trocar::engine
