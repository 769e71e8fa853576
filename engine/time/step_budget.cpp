#include "engine/time/step_budget.hpp"

#include <algorithm>
#include <limits>

namespace seldinger::engine {

namespace {

/// Pair tests between two readings of the clock at most: about 40 us of overrun at 10 ns a test, and the clock's own cost
/// (about 30 ns) stays below a thousandth of the tests'.
constexpr std::uint64_t kLargestGrant = 4096;
/// Grants that spent less say more about the clock than about the tests: they teach nothing.
constexpr std::uint64_t kSmallestLesson = 64;
/// The forecast of the exact stage is its last cost; contacts grow between steps, so a third is kept in reserve.
constexpr double kExactReserve = 1.33;
/// Weight of the newest measurement: a rate that changes tenfold is followed within some ten steps.
constexpr double kLearning = 0.2;
/// Per step in which the exact stage was not tried its remembered rate shrinks by this: one slow run (a cold cache, another
/// process) must not keep it away for ever. Halved within 35 steps.
constexpr double kForget = 0.98;

void learn(double& rate, double measured) noexcept { rate += kLearning * (measured - rate); }

std::uint64_t exact_units(const ExactForecast& forecast) noexcept {
    return forecast.candidates * kUnitsPerCandidate + forecast.triangles * kUnitsPerRefitTriangle;
}

} // namespace

void StepBudget::begin() noexcept {
    charged_ns_ = 0;
    units_spent_ = 0;
    if (!exact_tried_) exact_s_per_unit_ *= kForget;
    exact_tried_ = false;
    running_ = true;
    running_since_ = clock_->now_ns();
}

void StepBudget::pause() noexcept {
    if (running_) charged_ns_ += clock_->now_ns() - running_since_;
    running_ = false;
}

void StepBudget::resume() noexcept {
    if (!running_) running_since_ = clock_->now_ns();
    running_ = true;
}

double StepBudget::elapsed_s() const noexcept {
    const std::int64_t open = running_ ? clock_->now_ns() - running_since_ : 0;
    return static_cast<double>(charged_ns_ + open) * 1e-9;
}

double StepBudget::limit_s() const noexcept {
    return limits_.mode == BudgetMode::Wall ? limits_.wall_s : std::numeric_limits<double>::infinity();
}

double StepBudget::left_s() const noexcept { return limit_s() - elapsed_s(); }

std::uint64_t StepBudget::units_left() const noexcept {
    if (limits_.mode != BudgetMode::Work) return WorkBudget::kUnlimited;
    return limits_.work_units > units_spent_ ? limits_.work_units - units_spent_ : 0;
}

WorkBudget StepBudget::grant_descent() noexcept {
    if (limits_.mode != BudgetMode::Wall) return WorkBudget(units_left());
    operation_start_ns_ = clock_->now_ns();
    const double left = left_s();
    if (!(left > 0.0)) return WorkBudget(0);
    const double affordable = left / descent_s_per_unit_;
    if (affordable < 1.0) return WorkBudget(0);
    return WorkBudget(static_cast<std::uint64_t>(std::min(affordable, static_cast<double>(kLargestGrant))));
}

void StepBudget::settle_descent(const WorkBudget& grant) noexcept {
    units_spent_ += grant.spent();
    if (limits_.mode != BudgetMode::Wall || grant.spent() < kSmallestLesson) return;
    learn(descent_s_per_unit_,
          static_cast<double>(clock_->now_ns() - operation_start_ns_) * 1e-9 / static_cast<double>(grant.spent()));
}

double StepBudget::exact_seconds(const ExactForecast& forecast) const noexcept {
    return kExactReserve * static_cast<double>(exact_units(forecast)) * exact_s_per_unit_;
}

bool StepBudget::exact_fits(const ExactForecast& forecast) const noexcept {
    switch (limits_.mode) {
    case BudgetMode::Exact: return true;
    case BudgetMode::Work: return exact_units(forecast) <= units_left();
    case BudgetMode::Wall: return exact_seconds(forecast) <= left_s();
    }
    return false;
}

WorkBudget StepBudget::grant_exact(const ExactForecast& forecast) noexcept {
    exact_tried_ = true;
    operation_start_ns_ = clock_->now_ns();
    const std::uint64_t refit = forecast.triangles * kUnitsPerRefitTriangle;
    if (limits_.mode == BudgetMode::Exact) return WorkBudget(WorkBudget::kUnlimited);
    if (limits_.mode == BudgetMode::Work)
        return WorkBudget(units_left() > refit ? (units_left() - refit) / kUnitsPerCandidate : 0);
    const double affordable = left_s() / exact_s_per_unit_ - static_cast<double>(refit);
    if (!(affordable > 0.0)) return WorkBudget(0);
    return WorkBudget(static_cast<std::uint64_t>(affordable / kUnitsPerCandidate));
}

void StepBudget::settle_exact(const ExactForecast& forecast, const WorkBudget& grant) noexcept {
    const std::uint64_t units = grant.spent() * kUnitsPerCandidate + forecast.triangles * kUnitsPerRefitTriangle;
    units_spent_ += units;
    if (limits_.mode != BudgetMode::Wall || units == 0) return;
    learn(exact_s_per_unit_, static_cast<double>(clock_->now_ns() - operation_start_ns_) * 1e-9 / static_cast<double>(units));
}

} // namespace seldinger::engine
