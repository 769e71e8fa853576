// A clock that a test moves, the three kinds of limits, and an exact stage simulated on them.
#pragma once

#include "engine/time/step_budget.hpp"

#include <cmath>

namespace trocar::engine::hand_clock {

class ManualClock final : public Clock {
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
    double candidate_s = 90e-9; // of the tests
};

/// True when it was started and came to its end.
inline bool run_exact(StepBudget& budget, ManualClock& clock, const ExactForecast& forecast, const Rounds& rounds) {
    if (!budget.exact_fits(forecast)) return false;
    for (int round = 0; round < rounds.count; ++round) {
        if (!budget.round_fits()) {
            budget.end_exact(false);
            return false;
        }
        clock.pass(rounds.solve_s);
        budget.end_solve();
        WorkBudget grant = budget.grant_tests(forecast);
        bool enough = true;
        for (std::uint64_t k = 0; k < forecast.candidates && enough; ++k) enough = grant.spend(1);
        clock.pass(rounds.candidate_s * static_cast<double>(grant.spent()));
        budget.settle_tests(forecast, grant);
        if (!enough) {
            budget.end_exact(false);
            return false;
        }
    }
    budget.end_exact(true);
    return true;
}

} // namespace trocar::engine::hand_clock
