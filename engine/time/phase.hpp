// A part of the step, charged to the budget for as long as this lives: what it takes is the forecast of the next one.
#pragma once

#include "engine/time/step_budget.hpp"

namespace trocar::engine {

class Phase {
public:
    Phase(StepBudget& budget, StepPart part) : budget_(&budget), part_(part) { budget.begin_part(part); }
    /// nullptr: nothing is charged.
    Phase(StepBudget* budget, StepPart part) : budget_(budget), part_(part) {
        if (budget != nullptr) budget->begin_part(part);
    }
    ~Phase() { end(); }
    Phase(const Phase&) = delete;
    Phase& operator=(const Phase&) = delete;

    /// Before its scope does.
    void end() noexcept {
        if (budget_ != nullptr) budget_->end_part(part_);
        budget_ = nullptr;
    }
    /// It was no such part as the next one will be: its cost is no forecast.
    void forget() noexcept { budget_ = nullptr; }

private:
    StepBudget* budget_;
    StepPart part_;
};

} // namespace trocar::engine
