// Simulated time against wall time, by a clock that the test moves.
#include "engine/time/pacer.hpp"

#include <gtest/gtest.h>

#include <random>

namespace trocar::engine {
namespace {

constexpr std::int64_t kMs = 1'000'000;

/// Steps of these lengths, one after another; returns when the last one began.
std::int64_t run(Pacer& pacer, const std::vector<std::int64_t>& lengths, std::int64_t now = 5 * kMs) {
    std::int64_t began = now;
    for (const std::int64_t length : lengths) {
        began = pacer.begin_step(now);
        EXPECT_GE(began, now) << "no step begins in the past";
        now = began + length;
    }
    return began;
}

TEST(Pace, StepsThatAreShortEnoughBeginOnTime) {
    Pacer pacer({.speed = 1.0}, 0.01);
    EXPECT_EQ(run(pacer, std::vector<std::int64_t>(101, 9 * kMs)), 5 * kMs + 100 * 10 * kMs);
    EXPECT_EQ(pacer.stats().late_steps, 0u);
    EXPECT_EQ(pacer.stats().waited_ns, 100 * kMs);
}

TEST(Pace, OfHalfSpeedDoublesTheTimeBetweenSteps) {
    Pacer pacer({.speed = 0.5}, 0.01);
    EXPECT_EQ(run(pacer, std::vector<std::int64_t>(11, kMs)), 5 * kMs + 10 * 20 * kMs);
}

TEST(Pace, SlowMotionNeverMakesUpForALongStep) {
    Pacer pacer({.speed = 1.0, .late = LatePolicy::FallBehind}, 0.01);
    EXPECT_EQ(run(pacer, {kMs, 35 * kMs, kMs, kMs}), 5 * kMs + 10 * kMs + 35 * kMs + 10 * kMs);
    EXPECT_EQ(pacer.stats().late_steps, 1u);
    EXPECT_EQ(pacer.stats().lost_ns, 25 * kMs);
    EXPECT_EQ(pacer.stats().worst_late_ns, 25 * kMs);
}

TEST(Pace, CatchingUpEndsWhereNothingWouldHaveBeenLate) {
    Pacer pacer({.speed = 1.0, .late = LatePolicy::CatchUp}, 0.01);
    EXPECT_EQ(run(pacer, {kMs, 35 * kMs, kMs, kMs, kMs, kMs}), 5 * kMs + 5 * 10 * kMs);
    EXPECT_EQ(pacer.stats().late_steps, 3u) << "the third step begins 25 ms late, the fourth 16, the fifth 7, the sixth on time";
    EXPECT_EQ(pacer.stats().lost_ns, 0);
    EXPECT_EQ(pacer.stats().worst_late_ns, 25 * kMs);
}

TEST(Pace, NeitherPolicyEverRunsAheadOfTheClock) {
    std::mt19937 random(7);
    std::uniform_int_distribution<std::int64_t> length(0, 20 * kMs);
    for (const LatePolicy late : {LatePolicy::FallBehind, LatePolicy::CatchUp}) {
        Pacer pacer({.speed = 1.0, .late = late}, 0.01);
        std::int64_t now = 0;
        for (std::int64_t k = 0; k < 1000; ++k) {
            const std::int64_t began = pacer.begin_step(now);
            EXPECT_GE(began, k * 10 * kMs) << "seed 7, step " << k;
            now = began + length(random);
        }
        EXPECT_GT(pacer.stats().late_steps, 0u);
    }
}

TEST(Pace, AClockThatStoodStillOrLeptFallsBehindOnce) {
    Pacer pacer({.speed = 1.0, .late = LatePolicy::FallBehind}, 0.01);
    run(pacer, {kMs, kMs, 3600ll * 1000 * kMs, kMs, kMs}); // stopped by SIGSTOP for an hour
    EXPECT_EQ(pacer.stats().late_steps, 1u);
    EXPECT_EQ(pacer.stats().lost_ns, 3600ll * 1000 * kMs - 10 * kMs);
}

} // namespace
} // namespace trocar::engine
