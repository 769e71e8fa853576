// One step after another: the engine's loop, and the only way to advance a state.
#pragma once

#include "engine/step/context.hpp"
#include "engine/time/step_budget.hpp"

#include <memory>

namespace seldinger::engine {

class Simulator {
public:
    /// The model is only read and must outlive the simulator.
    explicit Simulator(const SceneModel& model);
    Simulator(const SceneModel& model, const Clock& clock);

    /// Advances by model.step_s. After a report with finite == false the state is the last good one, and no more steps
    /// are taken.
    const StepReport& step();

    [[nodiscard]] const SceneModel& model() const noexcept { return model_; }
    [[nodiscard]] const State& state() const noexcept { return state_; }
    /// What the last step's response pushed against: places where an instrument presses on its wall (gap: what is missing
    /// of the clearance), and sphere contacts of solid bodies.
    [[nodiscard]] std::span<const Contact> contacts() const noexcept;
    /// Spheres of the last descent, for pictures: links of an instrument at the end of the step.
    [[nodiscard]] const StepContext& context() const noexcept { return context_; }

private:
    void descend();
    void find_exact();
    void respond();
    void hold_back(double fraction);
    void scale_motion(double fraction);
    void insist_on_exact(std::size_t instrument);
    void retry_with_hand_stopped(std::size_t instrument);
    void forget_forces();
    void list_contacts();
    void check_rods();
    void observe();
    void finish_report();
    [[nodiscard]] bool any_instrument() const noexcept { return !model_.instruments.empty(); }

    const SceneModel& model_;
    MonotonicClock own_clock_;
    StepBudget budget_;
    State state_;
    StepContext context_;
    bool stopped_ = false;
};

} // namespace seldinger::engine
