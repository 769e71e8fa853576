// A clock that only moves when a test says so, the three kinds of limits, and an exact stage acted out on them.
#pragma once

#include "engine/time/step_budget.hpp"

#include <cmath>

namespace seldinger::engine::hand_clock {

class HandClock final : public Clock {
public:
    [[nodiscard]] std::int64_t now_ns() const noexcept override { return now_; }
    void pass(double seconds) { now_ += static_cast<std::int64_t>(std::llround(seconds * 1e9)); }

private:
    std::int64_t now_ = 1'000'000;
};

constexpr BudgetLimits wall(double seconds) { return {BudgetMode::Wall, seconds, 0}; }
constexpr BudgetLimits work(std::uint64_t units) { return {BudgetMode::Work, 0.0, units}; }
inline constexpr BudgetLimits kExact{};

/// How an exact stage goes: rounds of a solve and its tests.
struct Rounds {
    int count = 1;
    double solve_s = 0.1e-3;
    double unit_s = 15e-9; // of the tests
};

/// True when it was started and came to its end.
inline bool run_exact(StepBudget& budget, HandClock& clock, const ExactForecast& forecast, const Rounds& rounds) {
    if (!budget.exact_fits(forecast)) return false;
    for (int round = 0; round < rounds.count; ++round) {
        if (!budget.round_fits(forecast)) {
            budget.end_exact(false);
            return false;
        }
        clock.pass(rounds.solve_s);
        WorkBudget grant = budget.grant_tests(forecast);
        const bool enough = grant.spend(forecast.candidates);
        const std::uint64_t units = grant.spent() * kUnitsPerCandidate + forecast.triangles * kUnitsPerRefitTriangle;
        clock.pass(rounds.unit_s * static_cast<double>(units));
        budget.settle_tests(forecast, grant);
        if (!enough) {
            budget.end_exact(false);
            return false;
        }
    }
    budget.end_exact(true);
    return true;
}

} // namespace seldinger::engine::hand_clock
