// The exact search of two surfaces with image-space culling between its hierarchies and its tests: the same contacts, always.
#include "collision/culling/cull_twin.hpp"
#include "collision/search/interruptible_search.hpp"
#include "shapes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace trocar::collision {
namespace {

using testing::Random;
using testing::Surface;

/// Culls at once, or delivers its answer only after some parts of the candidates were decided; never: too late.
class TestStage final : public StageTwo {
public:
    explicit TestStage(int answers_after) : answers_after_(answers_after) {}
    void begin(const SurfacePair& pair, const CandidateLists& candidates, const PairOptions& options, WorkBudget&) override {
        culler_.gather(pair, candidates, options, snapshot_);
        EXPECT_TRUE(snapshot_.look({.resolution = 128}, twin_).ok());
        polled_ = 0;
    }
    void poll() override { ++polled_; }
    [[nodiscard]] bool is_apart(std::size_t candidate) const noexcept override {
        const Index pair = culler_.pair_of(candidate);
        return polled_ > answers_after_ && pair != kNoIndex && snapshot_.apart[pair] != 0;
    }
    void end() override {}

private:
    int answers_after_, polled_ = 0;
    CpuCullBackend twin_;
    CandidateCuller culler_;
    CullSnapshot snapshot_;
};

struct Bodies {
    Surface a, b;
    DopTree tree_a, tree_b;
    Bodies(Surface first, Surface second) : a(std::move(first)), b(std::move(second)) {
        a.close();
        b.close();
        tree_a.build(a.topology, a.t0, {});
        tree_b.build(b.topology, b.t0, {});
        tree_a.refit(a.motion());
        tree_b.refit(b.motion());
    }
    SearchSide side_a() { return {Thing::body(3), &tree_a, a.motion()}; }
    SearchSide side_b() { return {Thing::body(1), &tree_b, b.motion()}; }
};

/// All NaNs count as equal.
bool same_numbers(std::span<const double> x, std::span<const double> y) {
    return std::equal(x.begin(), x.end(), y.begin(), y.end(),
                      [](double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); });
}
bool same(const Contact& x, const Contact& y) {
    return x.origin == y.origin && x.a == y.a && x.b == y.b && same_numbers({&x.time, 1}, {&y.time, 1}) &&
           same_numbers({x.normal.data(), 3}, {y.normal.data(), 3}) && same_numbers(x.bary_a, y.bary_a) &&
           same_numbers(x.bary_b, y.bary_b) && std::ranges::equal(x.feature_a, y.feature_a) && std::ranges::equal(x.feature_b, y.feature_b);
}

/// returns  candidates that were skipped
std::uint64_t expect_the_same(Bodies& bodies, const PairOptions& options, int answers_after) {
    InterruptibleSearch search;
    WorkBudget unlimited, again;
    std::vector<Contact> plain, staged;
    const ExactStats expected = search.find(bodies.side_a(), bodies.side_b(), options, unlimited, plain);
    TestStage stage(answers_after);
    const ExactStats stats = search.find(bodies.side_a(), bodies.side_b(), options, stage, again, staged);
    EXPECT_EQ(plain.size(), staged.size());
    for (std::size_t k = 0; k < std::min(plain.size(), staged.size()); ++k) EXPECT_TRUE(same(plain[k], staged[k])) << k;
    EXPECT_EQ(stats.hits_vf, expected.hits_vf);
    EXPECT_EQ(stats.hits_ee, expected.hits_ee);
    EXPECT_EQ(stats.candidates_vf, expected.candidates_vf);
    EXPECT_EQ(stats.candidates_ee, expected.candidates_ee);
    EXPECT_EQ(stats.safe_fraction, expected.safe_fraction);
    EXPECT_EQ(stats.unresolved, expected.unresolved);
    EXPECT_EQ(again.spent(), unlimited.spent()); // a unit per candidate, tested or not
    return search.skipped();
}

TEST(TwoStageSearch, FindsTheContactsOfThePlainSearchToTheBit) {
    Random random(71);
    std::size_t skipped = 0;
    for (int round = 0; round < 6; ++round) {
        SCOPED_TRACE(::testing::Message() << "seed 71, round " << round);
        Bodies soups(testing::make_triangle_soup(random, 60, 1.0, 0.3, 0.2), testing::make_triangle_soup(random, 70, 1.0, 0.3, 0.2));
        for (const double distance : {0.0, 0.02}) skipped += expect_the_same(soups, {.distance = distance, .tolerance = 0.1 * distance}, 0);
    }
    EXPECT_GT(skipped, 500u); // 766
}

TEST(TwoStageSearch, ACatheterInAVesselAnAnswerThatComesMidwayOneThatComesTooLate) {
    Surface catheter = testing::make_bent_tube(1.0, 0.02, 200, 12, 1.5), vessel = testing::make_bent_tube(1.0, 0.04, 160, 24, 1.5);
    for (std::size_t v = 0; v < catheter.t0.size(); ++v) {
        catheter.t0[v] += Vec3(0.008, 0.0, 0.0);
        catheter.t1[v] = catheter.t0[v] + Vec3(0.012, 0.0, 0.001);
    }
    Bodies bodies(std::move(catheter), std::move(vessel));
    const PairOptions options{.distance = 1e-4, .tolerance = 1e-5};
    const std::uint64_t at_once = expect_the_same(bodies, options, 0), midway = expect_the_same(bodies, options, 3),
                        late = expect_the_same(bodies, options, 1 << 20);
    std::printf("candidates skipped: %llu at once, %llu midway, %llu late\n", static_cast<unsigned long long>(at_once),
                static_cast<unsigned long long>(midway), static_cast<unsigned long long>(late));
    EXPECT_GT(at_once, midway);
    EXPECT_GT(midway, 0u);
    EXPECT_EQ(late, 0u);
}

TEST(TwoStageSearch, WhatIsNotANumberIsTested) {
    Random random(72);
    for (const double bad : {std::numeric_limits<double>::quiet_NaN(), 1e300}) {
        Bodies soups(testing::make_triangle_soup(random, 30, 1.0, 0.3, 0.2), testing::make_triangle_soup(random, 30, 1.0, 0.3, 0.2));
        soups.a.t1[7][2] = bad;
        soups.tree_a.refit(soups.a.motion());
        expect_the_same(soups, {.distance = 0.02, .tolerance = 0.002}, 0);
    }
}

TEST(TwoStageSearch, AnInterruptedOneSaysSoAndIsNotCulled) {
    Random random(73);
    Bodies soups(testing::make_triangle_soup(random, 60, 1.0, 0.3, 0.2), testing::make_triangle_soup(random, 60, 1.0, 0.3, 0.2));
    InterruptibleSearch search;
    TestStage stage(0);
    WorkBudget few(100);
    std::vector<Contact> out;
    const ExactStats stats = search.find(soups.side_a(), soups.side_b(), {.distance = 0.02}, stage, few, out);
    EXPECT_FALSE(stats.finished);
    EXPECT_EQ(stats.safe_fraction, 0.0);
    EXPECT_TRUE(out.empty());
}

} // namespace
} // namespace trocar::collision
