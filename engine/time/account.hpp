// What each part of a step was granted of the budget, and what it took.
#pragma once

#include "engine/time/step_budget.hpp"

#include <algorithm>

namespace trocar::engine {

/// A part, for as long as this lives.
class AccountScope {
public:
    AccountScope(const StepBudget& budget, AccountEntry& entry) noexcept
        : budget_(budget), entry_(entry), start_s_(budget.elapsed_s()), start_units_(budget.units_spent()) {
        if (budget.limits().mode == BudgetMode::Wall) entry.granted_ms = 1e3 * std::max(0.0, budget.limit_s() - start_s_);
    }
    ~AccountScope() {
        entry_.used_ms += 1e3 * (budget_.elapsed_s() - start_s_);
        entry_.units += budget_.units_spent() - start_units_;
    }
    AccountScope(const AccountScope&) = delete;
    AccountScope& operator=(const AccountScope&) = delete;

private:
    const StepBudget& budget_;
    AccountEntry& entry_;
    double start_s_;
    std::uint64_t start_units_;
};

} // namespace trocar::engine
