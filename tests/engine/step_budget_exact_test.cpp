// When is the exact stage begun, when is it given up, and which forecasts are kept: on a clock that the test moves.
#include "hand_clock.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace trocar::engine {
namespace {

using namespace hand_clock;

TEST(StepBudget, AnExactStageThatWasNeverSeenIsNotTriedUnderATightBudgetAtOnceButInTheEnd) {
    ManualClock clock;
    StepBudget budget(clock, wall(0.5e-3));
    budget.begin();
    EXPECT_FALSE(run_exact(budget, clock, {10, 10}, {})) << "its first guess is 1 ms";
    int steps = 1;
    for (; steps < 1000 && !run_exact(budget, clock, {10, 10}, {}); ++steps) budget.begin();
    EXPECT_LT(steps, 100);
    EXPECT_FALSE(budget.overrun());
}

TEST(StepBudget, TheExactStageFitsWhenWhatItCostBeforeDoesWithAReserve) {
    ManualClock clock;
    StepBudget budget(clock, wall(2e-3));
    const ExactForecast forecast{1000, 0}; // 0.09 ms of tests
    for (int step = 0; step < 100; ++step) {
        budget.begin();
        ASSERT_TRUE(run_exact(budget, clock, forecast, {3, 0.2e-3})) << step; // 0.87 ms in all
    }
    budget.begin();
    clock.pass(1.0e-3);
    EXPECT_TRUE(budget.exact_fits(forecast)) << "0.87 ms in 1 ms";
    budget.begin();
    clock.pass(1.2e-3);
    EXPECT_FALSE(budget.exact_fits(forecast)) << "not in 0.8 ms";
    clock.pass(1.0e-3);
    EXPECT_FALSE(budget.exact_fits({0, 0})) << "nothing fits when the time is up";
}

TEST(StepBudget, AnotherRoundIsRefusedWhenItsSolveWouldNotFit) {
    ManualClock clock;
    StepBudget budget(clock, wall(1.0e-3));
    const ExactForecast forecast{100, 0};
    for (int step = 0; step < 100; ++step) {
        budget.begin();
        ASSERT_TRUE(run_exact(budget, clock, forecast, {1, 0.3e-3})) << step;
    }
    budget.begin();
    EXPECT_FALSE(run_exact(budget, clock, forecast, {10, 0.3e-3})) << "started for one round, abandoned when a fourth came";
    EXPECT_FALSE(budget.overrun()) << "in time: " << budget.elapsed_s();
    EXPECT_GE(budget.elapsed_s(), 0.6e-3) << "but not before it had to be";
}

TEST(StepBudget, TestsAreGrantedWhatIsLeftWithAReserve) {
    ManualClock clock;
    StepBudget budget(clock, wall(1.33 * 5e-3)); // 10000 candidates of 500 ns, the first guess
    budget.begin();
    EXPECT_NEAR(static_cast<double>(budget.grant_tests({100, 0}).left()), 10000.0, 1.0);
    EXPECT_NEAR(static_cast<double>(budget.grant_tests({100, 1 << 20}).left()), 10000.0, 1.0) << "the boxes are done: the clock knows";
    clock.pass(6.7e-3);
    EXPECT_EQ(budget.grant_tests({100, 0}).left(), 0u);
}

TEST(StepBudget, AStepThatSuddenlyCostsTenTimesMoreIsLateOnceAndNotTriedAgainAtOnce) {
    ManualClock clock;
    StepBudget budget(clock, wall(1e-3));
    const ExactForecast forecast{1000, 100};
    int tried = 0;
    for (int step = 0; step < 100; ++step) {
        budget.begin();
        if (run_exact(budget, clock, forecast, {1, 0.2e-3})) ++tried;
    }
    ASSERT_GT(tried, 50);
    int late = 0, last = -1;
    for (int step = 0; step < 20; ++step) {
        budget.begin();
        (void)run_exact(budget, clock, forecast, {1, 2e-3});
        if (budget.overrun()) {
            ++late;
            last = step;
        }
    }
    EXPECT_EQ(late, 1);
    EXPECT_EQ(last, 0);
}

TEST(StepBudget, TestsTenTimesSlowerThanForecastAreNotStartedOnceThatIsKnown) {
    ManualClock clock;
    StepBudget budget(clock, wall(1e-3));
    const ExactForecast forecast{4000, 100};
    int overruns = 0;
    for (int step = 0; step < 60; ++step) {
        budget.begin();
        (void)run_exact(budget, clock, forecast, {1, 0.05e-3, 900e-9});
        overruns += budget.overrun();
    }
    EXPECT_LE(overruns, 2);
}

TEST(StepBudget, OneSlowExactStageIsForgottenInTime) {
    ManualClock clock;
    StepBudget budget(clock, wall(2e-3));
    const ExactForecast forecast{4000, 100};
    budget.begin();
    ASSERT_FALSE(run_exact(budget, clock, forecast, {1, 20e-3})) << "no time is left for its tests";
    int refused = 0;
    for (bool fits = false; refused < 1000 && !fits; ++refused) {
        budget.begin();
        fits = budget.exact_fits(forecast);
    }
    EXPECT_GT(refused, 10) << "not at once";
    EXPECT_LT(refused, 300);
}

TEST(StepBudget, ASuspensionOfAnHourIsForgottenWithinTwoSecondsOfSteps) {
    ManualClock clock;
    StepBudget budget(clock, wall(2e-3));
    const ExactForecast forecast{1000, 100};
    const auto run_steps = [&](int count) {
        int done = 0;
        for (int step = 0; step < count; ++step) {
            budget.begin();
            done += run_exact(budget, clock, forecast, {1, 0.2e-3});
        }
        return done;
    };
    ASSERT_GT(run_steps(50), 40);
    budget.begin();
    (void)run_exact(budget, clock, forecast, {1, 3600.0});
    WorkBudget grant = budget.grant_descent();
    EXPECT_EQ(grant.left(), 0u);
    EXPECT_GT(run_steps(200), 50);
}

TEST(StepBudget, TheCostOfAnExactStageThatRunsEveryStepIsNotForgotten) {
    ManualClock clock;
    StepBudget budget(clock, wall(2e-3));
    const ExactForecast forecast{8000, 0};
    for (int step = 0; step < 200; ++step) {
        budget.begin();
        const bool done = run_exact(budget, clock, forecast, {1, 0.2e-3});
        ASSERT_TRUE(done || step < 100) << "step " << step << ", when the first guess is forgotten";
    }
    budget.begin();
    clock.pass(1.2e-3);
    EXPECT_FALSE(budget.exact_fits(forecast)) << "0.92 ms do not fit in 0.8 ms";
}

/// Steps with something in each that takes `seconds(step)` outside of the account, as steps do whose scope is collision: in how many of
/// those from the second on would an exact stage be begun?
template <class Measured, class Seconds>
int count_begun(ManualClock& clock, StepBudget& budget, int steps, Measured measured, Seconds seconds) {
    int begun = 0;
    for (int step = 0; step < steps; ++step) {
        budget.begin();
        begun += step > 0 && budget.exact_fits({100, 100});
        budget.pause();
        measured([&] { clock.pass(seconds(step)); });
    }
    return begun;
}

/// The boxes of the wall take 1.7 ms and no grant interrupts them: a stage that begins with them never fits into 1 ms, however long it is
/// since one was tried.
TEST(StepBudget, AStageWhoseRefitAloneIsTooLongIsNotBegunAgainAndAgain) {
    ManualClock clock;
    StepBudget budget(clock, wall(1e-3));
    const auto refit = [&](const auto& work) { budget.begin_part(StepPart::Walls), work(), budget.end_part(StepPart::Walls); };
    EXPECT_EQ(count_begun(clock, budget, 5000, refit, [](int) { return 1.7e-3; }), 0);
    EXPECT_GT(count_begun(clock, budget, 200, refit, [](int) { return 0.1e-3; }), 100) << "a wall that became cheap is tried again";
}

/// Of the steps, those with a whole response: where there is none, half of the planes are made, which teaches nothing of it.
int count_responses(ManualClock& clock, StepBudget& budget, int steps, double look_ahead_s, double response_s) {
    int whole = 0;
    for (int step = 0; step < steps; ++step) {
        budget.begin(false);
        budget.begin_part(StepPart::LookAhead), clock.pass(look_ahead_s), budget.end_part(StepPart::LookAhead);
        const CollisionScope charged(budget);
        budget.begin_part(StepPart::Respond);
        const bool fits = budget.response_fits();
        clock.pass(fits ? response_s : 0.1 * response_s);
        whole += fits;
        budget.end_response();
        if (fits) budget.end_part(StepPart::Respond);
    }
    return whole;
}

/// An hour of hard steps must not keep the easy ones after it from their answer: the look ahead of a step tells which it is.
TEST(StepBudget, AResponseThatBecameCheapIsTakenUpAgainAtOnce) {
    ManualClock clock;
    StepBudget budget(clock, wall(10e-3));
    (void)count_responses(clock, budget, 10, 0.5e-3, 5e-3);
    EXPECT_LT(count_responses(clock, budget, 5000, 3e-3, 30e-3), 30) << "tried now and then";
    EXPECT_GE(count_responses(clock, budget, 100, 0.2e-3, 2e-3), 99);
    EXPECT_LT(count_responses(clock, budget, 5000, 3e-3, 30e-3), 30);
    EXPECT_LE(count_responses(clock, budget, 1000, 0.2e-3, 30e-3), 20) << "a look ahead that says nothing of it is believed a few times";
}

/// As the refit: a solve that is timed in every step, within an exact stage or in place of one, keeps its forecast.
TEST(StepBudget, ASolveThatIsTooLongIsNotForgottenAsLongAsItIsSeen) {
    ManualClock clock;
    StepBudget budget(clock, wall(1e-3));
    const auto solve = [&](const auto& work) { budget.begin_solve(), work(), budget.end_solve(); };
    EXPECT_EQ(count_begun(clock, budget, 1000, solve, [](int) { return 2e-3; }), 0);
}

/// A step as an instrument's: boxes and planes are found, and the rod is solved, with an exact stage or without one.
struct Parts {
    double refit_s = 0.3e-3, planes_s = 0.3e-3, solve_s = 0.4e-3, skin_s = 0.1e-3, candidate_s = 90e-9;
};

/// True when the exact stage was begun.
bool run_step(StepBudget& budget, ManualClock& clock, const ExactForecast& forecast, const Parts& parts) {
    const auto pass_part = [&](StepPart part, double seconds) { budget.begin_part(part), clock.pass(seconds), budget.end_part(part); };
    budget.begin();
    const bool begun = budget.exact_fits(forecast);
    pass_part(StepPart::Walls, parts.refit_s);
    pass_part(StepPart::Planes, parts.planes_s);
    if (begun && !budget.round_fits()) {
        budget.end_exact(false);
        return true;
    }
    if (!begun) budget.begin_solve();
    clock.pass(parts.solve_s);
    budget.end_solve();
    if (!begun) return false;
    pass_part(StepPart::Skin, parts.skin_s);
    WorkBudget grant = budget.grant_tests(forecast);
    bool enough = true;
    for (std::uint64_t k = 0; k < forecast.candidates && enough; ++k) enough = grant.spend(1);
    clock.pass(parts.candidate_s * static_cast<double>(grant.spent()));
    budget.settle_tests(forecast, grant);
    budget.end_exact(enough);
    return true;
}

/// One part of a step is held up, by what else the machine does.
Parts hold_up(Parts parts, unsigned which, double seconds) {
    double* const all[] = {&parts.refit_s, &parts.planes_s, &parts.solve_s, &parts.skin_s};
    *all[which % 4] += seconds;
    return parts;
}

TEST(StepBudget, WhateverWasHeldUpBeforeAStageThatFitsIsBegunAgainWithinSixtySteps) {
    const ExactForecast forecast{1000, 0};
    for (unsigned seed = 1; seed <= 40; ++seed) {
        std::mt19937 dice(seed);
        ManualClock clock;
        StepBudget budget(clock, wall(8e-3));
        const unsigned every = 1 + dice() % 12;
        for (int step = 0; step < 400; ++step) { // any history
            const double late_s = dice() % every == 0 ? 1e-3 * (1 + dice() % (seed % 4 == 0 ? 40 : 6)) : 0.0;
            run_step(budget, clock, forecast, hold_up({}, dice(), late_s));
        }
        int refused = 0;
        while (refused < 1000 && !run_step(budget, clock, forecast, {})) ++refused;
        EXPECT_LE(refused, 60) << "seed " << seed;
        int begun = 0;
        for (int step = 0; step < 100; ++step) begun += run_step(budget, clock, forecast, {});
        EXPECT_GE(begun, 85) << "seed " << seed;
    }
}

/// Steps of 1.2 ms under 8 ms, of which up to every second is held up by 4 ms to 5 ms: they fit, held up or not.
TEST(StepBudget, AStageThatFitsAlsoWhenItIsHeldUpIsNotLockedOutByThat) {
    const ExactForecast forecast{1000, 0};
    for (const unsigned every : {2u, 3u, 5u, 8u}) {
        std::mt19937 dice(5);
        ManualClock clock;
        StepBudget budget(clock, wall(8e-3));
        int begun = 0, late = 0, locked_out = 0, longest = 0;
        for (int step = 0; step < 3000; ++step) {
            const double late_s = dice() % every == 0 ? 1e-3 * (4.0 + 0x1p-32 * dice()) : 0.0;
            const bool was_begun = run_step(budget, clock, forecast, hold_up({}, dice(), late_s));
            begun += was_begun;
            late += budget.overrun();
            locked_out = was_begun ? 0 : locked_out + 1;
            longest = std::max(longest, locked_out);
        }
        EXPECT_GE(begun, every > 5 ? 2400 : 750) << "every " << every;
        EXPECT_LE(longest, 35) << "every " << every;
        EXPECT_LE(late, 30) << "every " << every;
    }
}

/// What is granted for the tests of a round is what the stage was begun for: the same parts, the same reserve. Only where the number of
/// candidates is no longer reliable may one be begun in vain, and then it is given up in time.
TEST(StepBudget, AStageThatIsBegunIsGrantedAllItsTestsOrGivenUpInTime) {
    ManualClock clock;
    StepBudget budget(clock, wall(2e-3));
    const ExactForecast forecast{4000, 20000};
    const auto pass_part = [&](StepPart part, double seconds) { budget.begin_part(part), clock.pass(seconds), budget.end_part(part); };
    int begun = 0, granted = 0;
    for (int step = 0; step < 2000; ++step) {
        budget.begin();
        clock.pass(1e-5 * (step * 7919 % 200)); // what came before took from nothing to all of it
        if (!budget.exact_fits(forecast)) continue;
        ++begun;
        pass_part(StepPart::Walls, 0.1e-3);
        pass_part(StepPart::Planes, 0.2e-3);
        if (budget.round_fits()) {
            clock.pass(0.1e-3);
            budget.end_solve();
            pass_part(StepPart::Skin, 0.05e-3);
            WorkBudget grant = budget.grant_tests(forecast);
            bool enough = true;
            for (std::uint64_t k = 0; k < forecast.candidates && enough; ++k) enough = grant.spend(1);
            clock.pass(90e-9 * static_cast<double>(grant.spent()));
            budget.settle_tests(forecast, grant);
            budget.end_exact(enough);
            granted += enough;
        } else
            budget.end_exact(false);
        EXPECT_FALSE(budget.overrun()) << step;
    }
    EXPECT_GT(begun, 500);
    EXPECT_LT(begun, 1500);
    EXPECT_GE(granted, begun - 5);
}

/// What candidates cost does not depend on the boxes, which are many, nor on how few they were last time: stages of 1,000 candidates of
/// 600 ns among stages of 50, and each that is begun with time enough for what it says is in time.
TEST(StepBudget, FewCandidatesDoNotMakeManySeemCheap) {
    ManualClock clock;
    StepBudget budget(clock, wall(1e-3));
    int late = 0, done = 0;
    for (int step = 0; step < 2000; ++step) {
        budget.begin();
        const bool many = step % 40 == 39;
        clock.pass(many ? 0.4e-3 : 0.1e-3); // 0.6 ms are left of which 0.65 would be needed
        done += run_exact(budget, clock, {many ? 1000u : 50u, 20000}, {1, 0.05e-3, 600e-9});
        late += step > 40 && budget.overrun();
    }
    EXPECT_EQ(late, 0);
    EXPECT_GT(done, 1000);
}

/// A candidate takes 60 ns. After a thousand steps without any the forecast is not zero: what is granted fits.
TEST(StepBudget, WhatTestsCostIsNotForgottenBelowTheLowestThatWasSeen) {
    ManualClock clock;
    StepBudget budget(clock, wall(2e-3));
    const ExactForecast forecast{5000, 0};
    for (int step = 0; step < 200; ++step) {
        budget.begin();
        (void)run_exact(budget, clock, forecast, {1, 0.1e-3, 60e-9});
    }
    for (int step = 0; step < 1000; ++step) budget.begin();
    const WorkBudget grant = budget.grant_tests(forecast);
    EXPECT_NEAR(60e-9 * static_cast<double>(grant.left()), 2e-3 / 1.33, 2e-5);
}

} // namespace
} // namespace trocar::engine
