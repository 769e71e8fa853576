// Units for the surfaces of solids, a few at a time: what the budget has no room for is left.
#pragma once

#include "engine/time/step_budget.hpp"

namespace trocar::engine {

class SurfaceAccount {
public:
    explicit SurfaceAccount(StepBudget& budget) noexcept : budget_(budget) {}
    ~SurfaceAccount() { settle(); }
    SurfaceAccount(const SurfaceAccount&) = delete;
    SurfaceAccount& operator=(const SurfaceAccount&) = delete;

    /// Is there room for so many units, and for `after` others that follow? True: they are spent on what the caller does next.
    [[nodiscard]] bool take(std::uint64_t units, std::uint64_t after = 0) {
        if (units == 0 || (open_ && after == 0 && grant_.spend(units))) return true;
        settle();
        if (units + after >= refused_) return false; // what is left only falls
        grant_ = budget_.grant_surfaces(units + after);
        open_ = true;
        if (grant_.left() >= units + after && grant_.spend(units)) return true;
        refused_ = units + after;
        return false;
    }

    /// The same, of what the last grant has left.
    [[nodiscard]] bool take_more(std::uint64_t units) { return units == 0 || (open_ && grant_.spend(units)); }

    /// What was taken is done.
    void settle() noexcept {
        if (open_) budget_.settle_surfaces(grant_);
        open_ = false;
    }

private:
    StepBudget& budget_;
    WorkBudget grant_{0};
    bool open_ = false;
    std::uint64_t refused_ = WorkBudget::kUnlimited;
};

} // namespace trocar::engine
