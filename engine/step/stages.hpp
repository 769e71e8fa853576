// The stages of a step before contacts are looked for. Each gives its parts of state and scratch to what does the work.
#pragma once

#include "engine/state/inputs.hpp"
#include "engine/state/state.hpp"
#include "engine/step/scratch.hpp"
#include "engine/time/clock.hpp"
#include "engine/time/step_budget.hpp"
#include "engine/time/step_probe.hpp"

namespace trocar::engine {

/// Adds the time for which it lives to a stage's and to the step's, ms; what a probe takes is not in it.
class Timed {
public:
    Timed(double& stage, double& total, const StepBudget& budget, ProbedPart part) noexcept : probed_(budget.probe(), part), stage_(stage), total_(total) {}
    ~Timed() {
        const double ms = watch_.elapsed_ms();
        stage_ += ms;
        total_ += ms;
    }
    Timed(const Timed&) = delete;
    Timed& operator=(const Timed&) = delete;

private:
    ProbeScope probed_; // begins before the watch and ends after it
    double &stage_, &total_;
    StopWatch watch_;
};

/// Of the step after the state's.
StepReport& start_report(const SceneModel& model, const State& state, StepReport& report);

/// What the step simulates: the model's effects but for what the inputs leave out.
/// effects   memory of the last step's is used again
void find_live_effects(const SceneModel& model, const LiveEffects& live, EffectSet& effects);

/// Effects that the budget leaves out of this step, a bit per Droppable; starts the budget's account.
[[nodiscard]] unsigned choose_drops(const SceneModel& model, StepBudget& budget, StepReport& report);

/// Notes where everything is before the step moves it.
void keep_start(const SceneModel& model, State& state, BodiesScratch& bodies, SolidScratch& solids, RodsScratch& rods);

/// Puts everything back there.
void restore_start(const SceneModel& model, State& state, const BodiesScratch& bodies, const SolidScratch& solids, const RodsScratch& rods);

/// Drive commands and what pulls at the tissue.
/// dropped   of choose_drops
void apply_inputs(const SceneModel& model, const EffectSet& live, unsigned dropped, const Inputs& inputs, State& state, BodiesScratch& bodies,
                  RodsScratch& rods, StepReport& report);

/// dropped   of choose_drops
void integrate_tissue(const SceneModel& model, const EffectSet& live, unsigned dropped, State& state, BodiesScratch& bodies,
                      StepReport& report, StepBudget& budget);

/// Surfaces and nodes of the step's start, for the stages that compare with them: views of what keep_start and integrate_tissue kept.
void share_start(const SceneModel& model, const BodiesScratch& bodies, SolidScratch& solids, RodsScratch& rods);

/// The free motion of instruments, between the planes of the last step; what presses then pushes the tissue.
/// dropped   of choose_drops
void predict_instruments(const SceneModel& model, const EffectSet& live, unsigned dropped, State& state, BodiesScratch& bodies, RodsScratch& rods,
                         StepReport& report, StepBudget& budget);

/// Of solids and instruments; of lumens where the budget is not charged for it.
void update_sphere_trees(const SceneModel& model, const EffectSet& live, State& state, SolidScratch& solids, RodsScratch& rods);

} // namespace trocar::engine
