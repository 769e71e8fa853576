// One deadline over a step. Kernels get small grants of work units; this is where microseconds become units, by rates that
// are measured as the run goes (wall) or declared once and for all (work).
#pragma once

#include "base/work_budget.hpp"
#include "engine/time/clock.hpp"

#include <cstdint>

namespace seldinger::engine {

enum class BudgetMode : std::uint8_t {
    Wall,  // microseconds of a monotonic clock
    Work,  // sphere-pair tests; the same answers on every run and machine
    Exact, // no limit: everything is tested, the exact stage always runs
};

struct BudgetLimits {
    BudgetMode mode = BudgetMode::Exact;
    double wall_s = 0.0;          // s per step, mode Wall
    std::uint64_t work_units = 0; // per step, mode Work
};

/// Declared rates of mode Work: what one operation of the exact stage costs in sphere-pair tests. Fixed numbers, so that no
/// machine changes an answer: from measurements of the main scene (a pair test ~10 ns, a candidate ~60 ns, a triangle's
/// refit ~20 ns), rounded.
inline constexpr std::uint64_t kUnitsPerCandidate = 6;
inline constexpr std::uint64_t kUnitsPerRefitTriangle = 2;

/// What the exact stage is expected to do: the numbers of its last run.
struct ExactForecast {
    std::uint64_t candidates = 0;
    std::uint64_t triangles = 0; // whose boxes are refitted
};

class StepBudget {
public:
    StepBudget(const Clock& clock, const BudgetLimits& limits) noexcept : clock_(&clock), limits_(limits) {}

    /// Starts the step's account.
    void begin() noexcept;
    /// Time that passes between pause and resume is not charged: steps whose scope is collision pause around the rest.
    void pause() noexcept;
    void resume() noexcept;

    /// The next grant for sphere-pair tests: small, so that the clock is read often enough. Empty when the time is up.
    [[nodiscard]] WorkBudget grant_descent() noexcept;
    void settle_descent(const WorkBudget& grant) noexcept;

    /// Does the exact stage, forecast from its last run, fit in what is left?
    [[nodiscard]] bool exact_fits(const ExactForecast& forecast) const noexcept;
    /// The grant for the exact stage's candidates; it ends early (and its answer is thrown away) when that runs out.
    [[nodiscard]] WorkBudget grant_exact(const ExactForecast& forecast) noexcept;
    void settle_exact(const ExactForecast& forecast, const WorkBudget& grant) noexcept;

    [[nodiscard]] double elapsed_s() const noexcept;  // charged so far in this step
    [[nodiscard]] double limit_s() const noexcept;    // infinity unless mode Wall
    [[nodiscard]] std::uint64_t units_spent() const noexcept { return units_spent_; }
    [[nodiscard]] bool overrun() const noexcept { return limits_.mode == BudgetMode::Wall && elapsed_s() > limit_s(); }
    [[nodiscard]] const BudgetLimits& limits() const noexcept { return limits_; }

private:
    [[nodiscard]] double left_s() const noexcept;
    [[nodiscard]] std::uint64_t units_left() const noexcept;
    [[nodiscard]] double exact_seconds(const ExactForecast& forecast) const noexcept;

    const Clock* clock_;
    BudgetLimits limits_;
    std::int64_t charged_ns_ = 0;
    std::int64_t running_since_ = 0;
    bool running_ = false;
    bool exact_tried_ = true;
    std::uint64_t units_spent_ = 0;
    std::int64_t operation_start_ns_ = 0;
    double descent_s_per_unit_ = 20e-9; // s, replaced by the first measurement
    double exact_s_per_unit_ = 15e-9;   // s per work unit of the exact stage, likewise
};

} // namespace seldinger::engine
