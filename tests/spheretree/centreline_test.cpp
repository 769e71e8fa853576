// The lumen's middle as a tree: one branch for every dead end, in the middle, parents before children.
#include "shapes.hpp"
#include "spheretree/lumen/build_lumen.hpp"
#include "spheretree/lumen/centreline.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace trocar::spheretree {
namespace {

void expect_tree(const CentrelineTree& tree) {
    ASSERT_GT(tree.point_count(), 1u);
    EXPECT_EQ(tree.parents[0], kNoIndex);
    for (Index i = 1; i < tree.point_count(); ++i) {
        ASSERT_LT(tree.parents[i], i) << "parents come first";
        EXPECT_GT(tree.radii[i], 0.0);
    }
}

std::size_t count_ends(const CentrelineTree& tree) {
    std::vector<char> has_child(tree.point_count(), 0);
    for (Index i = 1; i < tree.point_count(); ++i) has_child[tree.parents[i]] = 1;
    return static_cast<std::size_t>(std::count(has_child.begin(), has_child.end(), 0));
}

TEST(Centreline, OfAStraightTubeIsItsAxis) {
    const TriMesh tube = test::make_straight_tube(3e-3, 0.08);
    const LumenTree lumen = build_lumen_tree(tube).value();
    const CentrelineTree tree = find_centreline_tree(lumen, Vec3(0, 0, 0.004)).value();
    expect_tree(tree);
    EXPECT_EQ(count_ends(tree), 1u) << "the piece behind the root is within its own width";
    double farthest = 0.0;
    for (Index i = 0; i < tree.point_count(); ++i) {
        farthest = std::max(farthest, tree.points[i].z());
        if (tree.points[i].z() > 0.08 - 3e-3) continue; // it ends in a corner of the cap
        EXPECT_LT(std::hypot(tree.points[i].x(), tree.points[i].y()), 0.6e-3);
        EXPECT_GT(tree.radii[i], 0.75 * 3e-3) << "balls beside the middle are smaller";
        EXPECT_LT(tree.radii[i], 1.01 * 3e-3);
        if (i > 0) EXPECT_LT((tree.points[i] - tree.points[tree.parents[i]]).norm(), 2e-3);
    }
    EXPECT_GT(farthest, 0.075);
}

TEST(Centreline, FromTheMiddleOfATubeGoesBothWays) {
    const TriMesh tube = test::make_straight_tube(3e-3, 0.08);
    const LumenTree lumen = build_lumen_tree(tube).value();
    const CentrelineTree tree = find_centreline_tree(lumen, Vec3(0, 0, 0.03)).value();
    expect_tree(tree);
    EXPECT_EQ(count_ends(tree), 2u);
}

TEST(Centreline, ARootOutsideIsRefused) {
    const LumenTree lumen = build_lumen_tree(test::make_straight_tube(3e-3, 0.08)).value();
    EXPECT_FALSE(find_centreline_tree(lumen, Vec3(0.05, 0, 0.03)).ok());
}

} // namespace
} // namespace trocar::spheretree
