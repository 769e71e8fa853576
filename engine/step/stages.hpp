// The stages of a step before contacts are looked for. Each gives its parts of state and scratch to what does the work.
#pragma once

#include "engine/state/inputs.hpp"
#include "engine/step/scratch.hpp"
#include "engine/time/clock.hpp"
#include "engine/time/step_budget.hpp"

namespace trocar::engine {

/// Adds the time for which it lives to a stage's and to the step's, ms.
class Timed {
public:
    Timed(double& stage, double& total) noexcept : stage_(stage), total_(total) {}
    ~Timed() {
        const double ms = watch_.elapsed_ms();
        stage_ += ms;
        total_ += ms;
    }
    Timed(const Timed&) = delete;
    Timed& operator=(const Timed&) = delete;

private:
    double &stage_, &total_;
    StopWatch watch_;
};

/// Of the step after the state's.
StepReport& start_report(const SceneModel& model, const State& state, StepReport& report);

/// What the step simulates: the model's effects but for what the inputs leave out.
[[nodiscard]] EffectSet find_live_effects(const SceneModel& model, const LiveEffects& live);

/// Which effects are live in this step, and which its budget leaves out; starts the budget's account.
void choose_effects(const SceneModel& model, const Inputs& inputs, StepScratch& scratch, StepBudget& budget);

/// Notes where everything is before the step moves it.
void keep_start(const SceneModel& model, const State& state, StepScratch& scratch);

/// Puts everything back there.
void restore_start(const SceneModel& model, State& state, const StepScratch& scratch);

/// Drive commands and what pulls at the tissue.
void apply_inputs(const SceneModel& model, const Inputs& inputs, State& state, StepScratch& scratch);

void integrate_tissue(const SceneModel& model, State& state, StepScratch& scratch, StepBudget& budget);

/// The free motion of instruments, between the planes of the last step.
void predict_instruments(const SceneModel& model, const EffectSet& live, State& state, RodsScratch& rods, StepReport& report);

/// Of solids and instruments; of lumens where the budget is not charged for it.
void update_sphere_trees(const SceneModel& model, State& state, StepScratch& scratch);

} // namespace trocar::engine
