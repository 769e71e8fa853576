// The step's account: every grant and refusal, on a clock that only moves when a test says so.
#include "engine/time/step_budget.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace seldinger::engine {
namespace {

class HandClock final : public Clock {
public:
    [[nodiscard]] std::int64_t now_ns() const noexcept override { return now_; }
    void pass(double seconds) { now_ += static_cast<std::int64_t>(std::llround(seconds * 1e9)); }

private:
    std::int64_t now_ = 1'000'000;
};

constexpr BudgetLimits wall(double seconds) { return {BudgetMode::Wall, seconds, 0}; }
constexpr BudgetLimits work(std::uint64_t units) { return {BudgetMode::Work, 0.0, units}; }
constexpr BudgetLimits kExact{};

/// Spends the whole grant; each unit takes `seconds`.
void use_up(StepBudget& budget, HandClock& clock, WorkBudget grant, double seconds) {
    const std::uint64_t units = grant.left();
    ASSERT_TRUE(grant.spend(units));
    clock.pass(seconds * static_cast<double>(units));
    budget.settle_descent(grant);
}

/// Descends until nothing more is granted; returns the units that were done.
std::uint64_t descend(StepBudget& budget, HandClock& clock, double seconds_per_unit) {
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
    HandClock clock;
    StepBudget large(clock, wall(1e-3)), small(clock, wall(10e-6));
    large.begin();
    small.begin();
    EXPECT_EQ(large.grant_descent().left(), 4096u);
    EXPECT_EQ(small.grant_descent().left(), 500u) << "10 us at 20 ns";
}

TEST(StepBudget, NothingIsGrantedOnceTheTimeIsUpOrTooShortForOneTest) {
    HandClock clock;
    StepBudget budget(clock, wall(1e-6));
    budget.begin();
    EXPECT_GT(budget.grant_descent().left(), 0u);
    clock.pass(0.99e-6);
    EXPECT_EQ(budget.grant_descent().left(), 0u) << "10 ns are half a test";
    clock.pass(1e-6);
    EXPECT_EQ(budget.grant_descent().left(), 0u);
    EXPECT_TRUE(budget.overrun());
    budget.begin();
    EXPECT_FALSE(budget.overrun());
    EXPECT_GT(budget.grant_descent().left(), 0u) << "a new step has a new account";
}

TEST(StepBudget, DescentAtTheForecastRateEndsWithinTheLimit) {
    HandClock clock;
    StepBudget budget(clock, wall(1e-3));
    budget.begin();
    const std::uint64_t done = descend(budget, clock, 20e-9);
    EXPECT_NEAR(static_cast<double>(done), 50000.0, 2.0);
    EXPECT_LE(budget.elapsed_s(), 1e-3 + 1e-9);
    EXPECT_EQ(budget.units_spent(), done);
}

TEST(StepBudget, TestsTenTimesSlowerThanForecastOverrunOnceByLessThanAGrantAndThenNoMore) {
    HandClock clock;
    constexpr double kSlow = 200e-9;
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

TEST(StepBudget, AfterTestsBecomeFasterAgainTheTimeIsUsedAgain) {
    HandClock clock;
    StepBudget budget(clock, wall(1e-3));
    for (int step = 0; step < 20; ++step) {
        budget.begin();
        descend(budget, clock, 200e-9);
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
    HandClock clock;
    StepBudget budget(clock, wall(10e-6));
    budget.begin();
    WorkBudget grant = budget.grant_descent();
    ASSERT_EQ(grant.left(), 500u);
    ASSERT_TRUE(grant.spend(63));
    clock.pass(5e-6); // 80 ns a test, but most of it is the clock's
    budget.settle_descent(grant);
    budget.begin();
    EXPECT_EQ(budget.grant_descent().left(), 500u);
}

TEST(StepBudget, PausedTimeIsNotCharged) {
    HandClock clock;
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
    HandClock clock;
    StepBudget budget(clock, wall(1e-3));
    budget.begin();
    budget.pause();
    budget.begin();
    clock.pass(0.4e-3);
    EXPECT_DOUBLE_EQ(budget.elapsed_s(), 0.4e-3);
}

TEST(StepBudget, TheExactStageFitsWhenItsForecastWithReserveDoes) {
    HandClock clock;
    StepBudget budget(clock, wall(1e-3));
    budget.begin();
    EXPECT_TRUE(budget.exact_fits({8000, 0})) << "48000 units, 15 ns each, a third in reserve: 0.958 ms";
    EXPECT_FALSE(budget.exact_fits({8500, 0}));
    EXPECT_FALSE(budget.exact_fits({8000, 1500})) << "refitted triangles count too";
    clock.pass(0.5e-3);
    EXPECT_FALSE(budget.exact_fits({8000, 0}));
    EXPECT_TRUE(budget.exact_fits({4000, 0}));
    clock.pass(0.6e-3);
    EXPECT_FALSE(budget.exact_fits({0, 0}));
}

TEST(StepBudget, TheExactGrantIsWhatIsLeftAfterTheRefit) {
    HandClock clock;
    StepBudget budget(clock, wall(0.9e-3)); // 60000 units of 15 ns
    budget.begin();
    EXPECT_NEAR(static_cast<double>(budget.grant_exact({100, 0}).left()), 10000.0, 1.0);
    EXPECT_NEAR(static_cast<double>(budget.grant_exact({100, 15000}).left()), 5000.0, 1.0);
    EXPECT_EQ(budget.grant_exact({100, 40000}).left(), 0u);
    clock.pass(1e-3);
    EXPECT_EQ(budget.grant_exact({100, 0}).left(), 0u);
}

/// One exact stage of `candidates` at `seconds` per unit.
void run_exact(StepBudget& budget, HandClock& clock, const ExactForecast& forecast, double seconds) {
    WorkBudget grant = budget.grant_exact(forecast);
    const std::uint64_t done = std::min(grant.left(), forecast.candidates);
    ASSERT_TRUE(grant.spend(done));
    clock.pass(seconds * static_cast<double>(done * kUnitsPerCandidate + forecast.triangles * kUnitsPerRefitTriangle));
    budget.settle_exact(forecast, grant);
}

TEST(StepBudget, AnExactStageTenTimesSlowerThanForecastIsNotStartedOnceItsRateIsKnown) {
    HandClock clock;
    StepBudget budget(clock, wall(1e-3));
    const ExactForecast forecast{4000, 100};
    int overruns = 0, last = -1;
    for (int step = 0; step < 12; ++step) {
        budget.begin();
        if (budget.exact_fits(forecast)) run_exact(budget, clock, forecast, 150e-9);
        if (budget.overrun()) {
            ++overruns;
            last = step;
        }
    }
    EXPECT_LE(overruns, 3);
    EXPECT_LE(last, 3);
}

TEST(StepBudget, OneSlowExactStageIsForgottenInTime) {
    HandClock clock;
    StepBudget budget(clock, wall(1e-3));
    const ExactForecast forecast{4000, 100};
    budget.begin();
    ASSERT_TRUE(budget.exact_fits(forecast));
    run_exact(budget, clock, forecast, 500e-9);
    budget.begin();
    EXPECT_FALSE(budget.exact_fits(forecast));
    int refused = 1;
    for (; refused < 1000 && !budget.exact_fits(forecast); ++refused) budget.begin();
    EXPECT_TRUE(budget.exact_fits(forecast));
    EXPECT_GT(refused, 10) << "not at once";
    EXPECT_LT(refused, 100);
}

TEST(StepBudget, TheRateOfAnExactStageThatRunsEveryStepIsNotForgotten) {
    HandClock clock;
    StepBudget budget(clock, wall(1e-3));
    const ExactForecast forecast{8000, 0};
    for (int step = 0; step < 200; ++step) {
        budget.begin();
        ASSERT_TRUE(budget.exact_fits(forecast)) << "step " << step;
        run_exact(budget, clock, forecast, 15e-9);
    }
    budget.begin();
    EXPECT_FALSE(budget.exact_fits({8500, 0})) << "the rate has not crept down";
}

TEST(StepBudget, WorkGrantsAreWhatIsLeftAndNothingElse) {
    HandClock clock;
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
    HandClock clock;
    StepBudget fits(clock, work(700)), too_small(clock, work(699));
    fits.begin();
    too_small.begin();
    const ExactForecast forecast{100, 50}; // 100 * 6 + 50 * 2
    EXPECT_TRUE(fits.exact_fits(forecast));
    EXPECT_FALSE(too_small.exact_fits(forecast));
    EXPECT_EQ(fits.grant_exact(forecast).left(), 100u);
    EXPECT_EQ(too_small.grant_exact(forecast).left(), 99u) << "the last candidate is not paid for in part";
    run_exact(fits, clock, forecast, 1.0);
    EXPECT_EQ(fits.units_spent(), 700u);
    EXPECT_EQ(fits.grant_exact(forecast).left(), 0u);
    EXPECT_EQ(fits.grant_descent().left(), 0u);
}

TEST(StepBudget, WorkThatWasOverspentLeavesNothingAndDoesNotWrapRound) {
    HandClock clock;
    StepBudget budget(clock, work(10));
    budget.begin();
    WorkBudget unlimited;
    ASSERT_TRUE(unlimited.spend(1000));
    budget.settle_descent(unlimited);
    EXPECT_EQ(budget.grant_descent().left(), 0u);
    EXPECT_FALSE(budget.exact_fits({1, 0}));
    EXPECT_EQ(budget.grant_exact({1, 0}).left(), 0u);
}

TEST(StepBudget, WithoutALimitEverythingIsGranted) {
    HandClock clock;
    StepBudget budget(clock, kExact);
    budget.begin();
    clock.pass(1e6);
    EXPECT_EQ(budget.grant_descent().left(), WorkBudget::kUnlimited);
    EXPECT_TRUE(budget.exact_fits({std::uint64_t{1} << 60, 0}));
    EXPECT_EQ(budget.grant_exact({1, 1}).left(), WorkBudget::kUnlimited);
    EXPECT_TRUE(std::isinf(budget.limit_s()));
    EXPECT_FALSE(budget.overrun());
}

TEST(StepBudget, ABudgetOfNothingGrantsNothing) {
    HandClock clock;
    StepBudget no_time(clock, wall(0.0)), no_work(clock, work(0));
    for (StepBudget* budget : {&no_time, &no_work}) {
        budget->begin();
        EXPECT_EQ(budget->grant_descent().left(), 0u);
        EXPECT_FALSE(budget->exact_fits({1, 0}));
        EXPECT_FALSE(budget->exact_fits({0, 1}));
        EXPECT_EQ(budget->grant_exact({1, 1}).left(), 0u);
        EXPECT_EQ(budget->units_spent(), 0u);
    }
}

} // namespace
} // namespace seldinger::engine
