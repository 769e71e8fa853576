#include "shapes.hpp"
#include "spheretree/traverse/sweep_and_prune.hpp"

#include <gtest/gtest.h>

namespace trocar::spheretree {
namespace {

using Pairs = std::vector<std::pair<Index, Index>>;

Pairs brute_force(const std::vector<Box3>& boxes) {
    Pairs pairs;
    for (Index i = 0; i < boxes.size(); ++i)
        for (Index k = i + 1; k < boxes.size(); ++k)
            if (boxes[i].overlaps(boxes[k])) pairs.emplace_back(i, k);
    return pairs;
}

TEST(SweepAndPrune, FindsWhatBruteForceFindsWhileBoxesMove) {
    test::Random random(5);
    std::vector<Box3> boxes(60);
    std::vector<Vec3> speed;
    for (Box3& box : boxes) {
        box.add(random.in_box({Vec3::Zero(), Vec3(3, 1, 1)}));
        box.inflate(random.uniform(0.0, 0.2));
        speed.push_back(random.in_box({Vec3::Constant(-0.1), Vec3::Constant(0.1)}));
    }
    boxes[7] = Box3{};   // empty
    boxes[8] = boxes[9]; // the same
    SweepAndPrune sweep;
    Pairs found;
    std::size_t most = 0;
    for (int step = 0; step < 40; ++step) {
        sweep.find_pairs(boxes, found);
        ASSERT_EQ(found, brute_force(boxes)) << "seed 5, step " << step;
        most = std::max(most, found.size());
        for (std::size_t i = 0; i < boxes.size(); ++i)
            if (!boxes[i].empty()) boxes[i].lo += speed[i], boxes[i].hi += speed[i];
    }
    EXPECT_GT(most, 20u);
    EXPECT_LT(most, 60u * 59u / 2u);
}

TEST(SweepAndPrune, TouchingCountsAndNothingGivesNothing) {
    Box3 a, b;
    a.add(Vec3(0, 0, 0)), a.add(Vec3(1, 1, 1));
    b.add(Vec3(1, 1, 1)), b.add(Vec3(2, 2, 2));
    SweepAndPrune sweep;
    Pairs found{{3, 4}};
    sweep.find_pairs(std::vector<Box3>{}, found);
    EXPECT_TRUE(found.empty());
    sweep.find_pairs(std::vector<Box3>{a, b}, found);
    EXPECT_EQ(found, (Pairs{{0, 1}}));
}

} // namespace
} // namespace trocar::spheretree
