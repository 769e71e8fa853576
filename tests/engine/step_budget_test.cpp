// The step's account: every grant and refusal, on a clock that the test moves.
#include "hand_clock.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace trocar::engine {
namespace {

using namespace hand_clock;

/// Spends the whole grant; each unit takes `seconds`.
void use_up(StepBudget& budget, ManualClock& clock, WorkBudget grant, double seconds) {
    const std::uint64_t units = grant.left();
    ASSERT_TRUE(grant.spend(units));
    clock.pass(seconds * static_cast<double>(units));
    budget.settle_descent(grant);
}

/// Descends until nothing more is granted; returns the units that were done.
std::uint64_t descend(StepBudget& budget, ManualClock& clock, double seconds_per_unit) {
    std::uint64_t done = 0;
    for (int round = 0; round < 100000; ++round) {
        const WorkBudget grant = budget.grant_descent();
        if (grant.left() == 0) return done;
        done += grant.left();
        use_up(budget, clock, grant, seconds_per_unit);
    }
    ADD_FAILURE() << "grants never end";
    return done;
}

TEST(StepBudget, AWallGrantIsNeverLargerThanWhatTheTimePaysForOrTheClockShouldBeLeftAlone) {
    ManualClock clock;
    StepBudget large(clock, wall(10e-3)), small(clock, wall(10e-6));
    large.begin();
    small.begin();
    EXPECT_EQ(large.grant_descent().left(), 4096u);
    EXPECT_EQ(small.grant_descent().left(), 12u) << "an eighth of 10 us at 100 ns";
    StepBudget tiny(clock, wall(0.8e-6));
    tiny.begin();
    EXPECT_EQ(tiny.grant_descent().left(), 8u) << "all of 0.8 us: less is not worth reading the clock";
}

TEST(StepBudget, NothingIsGrantedOnceTheTimeIsUpOrTooShortForOneTest) {
    ManualClock clock;
    StepBudget budget(clock, wall(1e-6));
    budget.begin();
    EXPECT_GT(budget.grant_descent().left(), 0u);
    clock.pass(0.95e-6);
    EXPECT_EQ(budget.grant_descent().left(), 0u) << "50 ns are half a test";
    clock.pass(1e-6);
    EXPECT_EQ(budget.grant_descent().left(), 0u);
    EXPECT_TRUE(budget.overrun());
    budget.begin();
    EXPECT_FALSE(budget.overrun());
    EXPECT_GT(budget.grant_descent().left(), 0u) << "a new step has a new account";
}

TEST(StepBudget, DescentAtTheForecastRateEndsWithinTheLimit) {
    ManualClock clock;
    StepBudget budget(clock, wall(1e-3));
    budget.begin();
    const std::uint64_t done = descend(budget, clock, 100e-9);
    EXPECT_NEAR(static_cast<double>(done), 10000.0, 2.0);
    EXPECT_LE(budget.elapsed_s(), 1e-3 + 1e-9);
    EXPECT_EQ(budget.units_spent(), done);
}

TEST(StepBudget, TestsTenTimesSlowerThanForecastOverrunOnceByLessThanAGrantAndThenNoMore) {
    ManualClock clock;
    constexpr double kSlow = 1000e-9;
    StepBudget budget(clock, wall(1e-3));
    budget.begin();
    descend(budget, clock, kSlow);
    EXPECT_LE(budget.elapsed_s(), 1e-3 + 4096 * kSlow);
    for (int step = 0; step < 20; ++step) {
        budget.begin();
        descend(budget, clock, kSlow);
    }
    EXPECT_LE(budget.elapsed_s(), 1.02e-3);
    EXPECT_GE(budget.elapsed_s(), 0.9e-3) << "slow is no reason to give the time away";
}

TEST(StepBudget, AGrantTakesAnEighthOfWhatIsLeftSoThatARateThatRisesIsSeenInTime) {
    ManualClock clock;
    StepBudget budget(clock, wall(0.5e-3));
    budget.begin();
    EXPECT_EQ(budget.grant_descent().left(), 625u) << "of 5000 at 100 ns";
    descend(budget, clock, 500e-9);
    EXPECT_LE(budget.elapsed_s(), 0.5e-3 + 500e-9 * 8) << "late by a share of the smallest grant at most";
}

/// A ball's wall is tested in one piece: the grant covers all of it, or none is given.
TEST(StepBudget, AGrantIsNoSmallerThanWhatIsDoneNextOrThereIsNone) {
    ManualClock clock;
    StepBudget budget(clock, wall(10e-6)); // 100 tests of 100 ns
    budget.begin();
    EXPECT_EQ(budget.grant_descent(80).left(), 80u) << "more than the eighth that is usually given";
    EXPECT_EQ(budget.grant_descent(100).left(), 100u);
    EXPECT_EQ(budget.grant_descent(101).left(), 0u);
    WorkBudget piece = budget.grant_descent(50);
    ASSERT_TRUE(piece.spend(50));
    clock.pass(50 * 0.5e-6); // five times as slow as a test
    budget.settle_descent(piece);
    budget.begin();
    EXPECT_EQ(budget.grant_descent(33).left(), 33u) << "of 10 us at 0.3 us, half of the way to what it took";
    EXPECT_EQ(budget.grant_descent(34).left(), 0u);
    EXPECT_EQ(budget.grant_descent(5).left(), 12u) << "tests are no slower for that";
    StepBudget counted(clock, work(100));
    counted.begin();
    EXPECT_EQ(counted.grant_descent(100).left(), 100u);
    EXPECT_EQ(counted.grant_descent(101).left(), 0u) << "or the same question would be asked for ever";
}

TEST(StepBudget, WhatIsKeptBackIsNotGranted) {
    ManualClock clock;
    StepBudget budget(clock, wall(1e-3));
    budget.begin();
    budget.keep_back(0.4e-3);
    descend(budget, clock, 100e-9);
    EXPECT_LE(budget.elapsed_s(), 0.6e-3 + 1e-8);
    EXPECT_GE(budget.elapsed_s(), 0.59e-3);
    budget.begin();
    descend(budget, clock, 100e-9);
    EXPECT_GE(budget.elapsed_s(), 0.99e-3) << "for one step only";
}

TEST(StepBudget, AfterTestsBecomeFasterAgainTheTimeIsUsedAgain) {
    ManualClock clock;
    StepBudget budget(clock, wall(1e-3));
    for (int step = 0; step < 20; ++step) {
        budget.begin();
        descend(budget, clock, 1000e-9);
    }
    for (int step = 0; step < 20; ++step) {
        budget.begin();
        descend(budget, clock, 10e-9);
    }
    EXPECT_GE(descend(budget, clock, 10e-9), 0u);
    EXPECT_GE(budget.units_spent(), 95'000u) << "of 100000 that fit in 1 ms";
    EXPECT_LE(budget.elapsed_s(), 1e-3 + 1e-8);
}

TEST(StepBudget, AGrantOfAFewTestsTeachesNothing) {
    ManualClock clock;
    StepBudget budget(clock, wall(10e-6));
    budget.begin();
    WorkBudget grant = budget.grant_descent();
    ASSERT_EQ(grant.left(), 12u);
    ASSERT_TRUE(grant.spend(12));
    clock.pass(5e-6); // 400 ns a test, but most of it is reading the clock
    budget.settle_descent(grant);
    budget.begin();
    EXPECT_EQ(budget.grant_descent().left(), 12u);
}

TEST(StepBudget, SmallGrantsTeachTogetherOrARateThatAllowsNoLargerOnesWouldStay) {
    ManualClock clock;
    StepBudget budget(clock, wall(10e-6));
    for (int step = 0; step < 4; ++step) { // grants of 12 and fewer, at the first guess of 100 ns a test
        budget.begin();
        (void)descend(budget, clock, 10e-9);
    }
    budget.begin();
    EXPECT_GE(budget.grant_descent().left(), 60u) << "an eighth of 10 us at little more than 10 ns";
}

TEST(StepBudget, PausedTimeIsNotCharged) {
    ManualClock clock;
    StepBudget budget(clock, wall(1e-3));
    budget.begin();
    clock.pass(0.2e-3);
    budget.pause();
    clock.pass(5e-3);
    EXPECT_DOUBLE_EQ(budget.elapsed_s(), 0.2e-3);
    budget.pause();
    clock.pass(5e-3);
    budget.resume();
    clock.pass(0.3e-3);
    budget.resume();
    clock.pass(0.1e-3);
    EXPECT_NEAR(budget.elapsed_s(), 0.6e-3, 1e-12);
    EXPECT_FALSE(budget.overrun());
}

TEST(StepBudget, ABeginAfterAPauseRuns) {
    ManualClock clock;
    StepBudget budget(clock, wall(1e-3));
    budget.begin();
    budget.pause();
    budget.begin();
    clock.pass(0.4e-3);
    EXPECT_DOUBLE_EQ(budget.elapsed_s(), 0.4e-3);
}

TEST(StepBudget, ChargesTimeOfThreadAndClockApart) {
    ManualClock clock;
    StepBudget budget(clock, wall(1e-3));
    budget.begin();
    clock.pass(0.25e-3);
    EXPECT_DOUBLE_EQ(budget.elapsed_s(), 0.25e-3);
    EXPECT_DOUBLE_EQ(budget.elapsed_cpu_s(), 0.25e-3) << "a clock that cannot tell gives its time";
    budget.charge(0.5e-3);
    EXPECT_NEAR(budget.elapsed_s(), 0.75e-3, 1e-12);
}

/// A step whose tissue takes 4 ms and whose surfaces take 1 ms, forecast from a hundred others.
StepBudget with_forecasts(ManualClock& clock, double limit_s) {
    StepBudget budget(clock, wall(limit_s));
    for (int step = 0; step < 100; ++step) {
        budget.begin();
        budget.begin_part(StepPart::Tissue);
        clock.pass(4e-3);
        budget.end_part(StepPart::Tissue);
        budget.begin_part(StepPart::EmbeddedSurfaces);
        clock.pass(1e-3);
        budget.end_part(StepPart::EmbeddedSurfaces);
    }
    return budget;
}

TEST(StepBudget, EffectsAreLeftOutInTheirOrderUntilTheForecastFits) {
    ManualClock clock;
    constexpr Droppable kTissueFirst[] = {Droppable::Elasticity, Droppable::ExactContact};
    constexpr Droppable kExactFirst[] = {Droppable::ExactContact, Droppable::Elasticity};
    const unsigned tissue = drop_bit(Droppable::Elasticity), exact = drop_bit(Droppable::ExactContact);
    const auto drops = [&](double limit_s, std::span<const Droppable> order) {
        StepBudget budget = with_forecasts(clock, limit_s);
        budget.begin();
        return budget.choose_drops(order);
    };
    EXPECT_EQ(drops(8e-3, kTissueFirst), 0u) << "4 + 1 + 1 ms fit";
    EXPECT_EQ(drops(5.05e-3, kTissueFirst), tissue);
    EXPECT_EQ(drops(5.05e-3, kExactFirst), exact) << "5 ms fit without the exact stage's first guess";
    EXPECT_EQ(drops(3e-3, kExactFirst), exact | tissue);
    EXPECT_EQ(drops(0.1e-3, kTissueFirst), exact | tissue) << "what cannot be left out stays";
    EXPECT_EQ(drops(0.1e-3, {}), 0u) << "only what the scene names";
}

TEST(StepBudget, AnEffectThatWasLeftOutIsTriedAgain) {
    ManualClock clock;
    constexpr Droppable kTissue[] = {Droppable::Elasticity};
    StepBudget budget = with_forecasts(clock, 4e-3);
    int left_out = 0;
    for (bool dropped = true; dropped && left_out < 1000; ++left_out) {
        budget.begin();
        dropped = budget.choose_drops(kTissue) != 0;
    }
    EXPECT_GT(left_out, 10);
    EXPECT_LT(left_out, 200);
}

TEST(StepBudget, WhatTheClockDecidedIsRecordedAndReplayedWhateverTheClockSays) {
    ManualClock clock;
    StepBudget first(clock, wall(1e-3)), again(clock, wall(1e-3));
    std::vector<Decision> log;
    first.tape().record_into(&log);
    first.begin();
    const std::uint64_t done = descend(first, clock, 100e-9);
    EXPECT_FALSE(run_exact(first, clock, {10, 10}, {}));
    ASSERT_GT(log.size(), 3u);
    EXPECT_EQ(log.back(), (Decision{DecisionKind::Fits, 0}));
    again.tape().replay(log);
    again.begin();
    EXPECT_EQ(descend(again, clock, 5e-6), done) << "fifty times slower, and it does not matter";
    EXPECT_TRUE(again.tape().left_script()) << "not all of it was asked for yet";
    EXPECT_FALSE(run_exact(again, clock, {10, 10}, {}));
    EXPECT_FALSE(again.tape().left_script());
    EXPECT_EQ(again.grant_descent().left(), 0u) << "more is asked for than the record holds";
    EXPECT_TRUE(again.tape().left_script());
}

TEST(StepBudget, AReplayThatAsksForSomethingElseIsNoticed) {
    ManualClock clock;
    StepBudget budget(clock, wall(1e-3));
    const std::vector<Decision> script{{DecisionKind::Descent, 77}, {DecisionKind::Descent, 0}};
    budget.tape().replay(script);
    budget.begin();
    EXPECT_EQ(budget.grant_descent().left(), 77u);
    EXPECT_FALSE(budget.exact_fits({0, 0}));
    EXPECT_TRUE(budget.tape().left_script());
}

TEST(StepBudget, WorkGrantsAreWhatIsLeftAndNothingElse) {
    ManualClock clock;
    StepBudget budget(clock, work(1000));
    budget.begin();
    EXPECT_EQ(budget.grant_descent().left(), 1000u);
    WorkBudget grant = budget.grant_descent();
    ASSERT_TRUE(grant.spend(300));
    clock.pass(3600.0);
    budget.settle_descent(grant);
    EXPECT_EQ(budget.grant_descent().left(), 700u) << "no clock";
    EXPECT_EQ(budget.units_spent(), 300u);
    WorkBudget rest = budget.grant_descent();
    ASSERT_TRUE(rest.spend(700));
    budget.settle_descent(rest);
    EXPECT_EQ(budget.grant_descent().left(), 0u);
    EXPECT_FALSE(budget.overrun()) << "work has no deadline";
    budget.begin();
    EXPECT_EQ(budget.grant_descent().left(), 1000u);
}

TEST(StepBudget, InWorkModeTheExactStageCostsItsDeclaredRates) {
    ManualClock clock;
    StepBudget fits(clock, work(700)), too_small(clock, work(699));
    fits.begin();
    too_small.begin();
    const ExactForecast forecast{100, 50}; // 100 * 6 + 50 * 2
    EXPECT_FALSE(too_small.exact_fits(forecast));
    EXPECT_EQ(too_small.grant_tests(forecast).left(), 99u) << "the last candidate is not paid for in part";
    EXPECT_TRUE(run_exact(fits, clock, forecast, {1, 3600.0, 1.0})) << "no clock";
    EXPECT_EQ(fits.units_spent(), 700u);
    EXPECT_EQ(fits.grant_tests(forecast).left(), 0u);
    EXPECT_EQ(fits.grant_descent().left(), 0u);
}

TEST(StepBudget, WorkThatWasOverspentLeavesNothingAndDoesNotWrapRound) {
    ManualClock clock;
    StepBudget budget(clock, work(10));
    budget.begin();
    WorkBudget unlimited;
    ASSERT_TRUE(unlimited.spend(1000));
    budget.settle_descent(unlimited);
    EXPECT_EQ(budget.grant_descent().left(), 0u);
    EXPECT_FALSE(budget.exact_fits({1, 0}));
    EXPECT_EQ(budget.grant_tests({1, 0}).left(), 0u);
}

TEST(StepBudget, WithoutALimitEverythingIsGranted) {
    ManualClock clock;
    StepBudget budget(clock, kExact);
    budget.begin();
    clock.pass(1e6);
    EXPECT_EQ(budget.grant_descent().left(), WorkBudget::kUnlimited);
    EXPECT_TRUE(budget.exact_fits({std::uint64_t{1} << 60, 0}));
    EXPECT_TRUE(budget.round_fits());
    EXPECT_EQ(budget.grant_tests({1, 1}).left(), WorkBudget::kUnlimited);
    EXPECT_TRUE(std::isinf(budget.limit_s()));
    EXPECT_FALSE(budget.overrun());
}

TEST(StepBudget, ABudgetOfNothingGrantsNothing) {
    ManualClock clock;
    StepBudget no_time(clock, wall(0.0)), no_work(clock, work(0));
    for (StepBudget* budget : {&no_time, &no_work}) {
        budget->begin();
        EXPECT_EQ(budget->grant_descent().left(), 0u);
        EXPECT_FALSE(budget->exact_fits({1, 0}));
        EXPECT_FALSE(budget->exact_fits({0, 1}));
        EXPECT_EQ(budget->grant_tests({1, 1}).left(), 0u);
        EXPECT_EQ(budget->units_spent(), 0u);
    }
}

} // namespace
} // namespace trocar::engine
