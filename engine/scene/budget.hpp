// A step's budget as a scene or a command line writes it: "8ms", "work:20000", "exact".
#pragma once

#include "base/result.hpp"
#include "engine/time/step_budget.hpp"

#include <string>
#include <string_view>
#include <vector>

namespace trocar::engine {

/// What is charged to the budget.
enum class BudgetScope : std::uint8_t {
    Collision, // coarse and exact collision stages
    Step,      // the whole step
};

struct BudgetSpec {
    BudgetLimits limits;
    BudgetScope scope = BudgetScope::Collision;
    std::vector<Droppable> drop = {}; // what a step may leave out when it would not fit, first to go first

    /// As it would be written: "8ms", "work:20000", "exact".
    [[nodiscard]] std::string to_string() const;
};

/// A time with its unit (ns, us, ms, s), "work:" and the number of sphere-pair tests, an integer, or "exact". Zero is allowed:
/// nothing is tested then, everything assumed.
/// fails     BadValue: no unit, not finite, negative, above kMaxBudgetSeconds, or not understood
[[nodiscard]] Result<BudgetSpec> parse_budget(std::string_view text);

/// Longest wall budget of one step. Above an hour a unit was mistaken; `exact` has no limit.
inline constexpr double kMaxBudgetSeconds = 3600.0; // s

} // namespace trocar::engine
