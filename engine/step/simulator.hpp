// One step after another: the engine's loop, and the only way to advance a state.
#pragma once

#include "base/result.hpp"
#include "engine/step/context.hpp"
#include "engine/time/step_budget.hpp"

#include <memory>

namespace trocar::engine {

/// Every public call checks what it is given, and answers: with an Error that says what was found and what is expected, and then nothing
/// has changed; or, where it says so, by doing nothing. Nothing that is refused reaches the state.
class Simulator {
public:
    /// The model is only read and must outlive the simulator. It is one that prepare_scene made; settings that a caller changed in it
    /// (step, effects, contact, budget) are checked, and where no step can be taken with them, or under the budget that is given, none is:
    /// begin_step() returns false, and the report is not finite and says why.
    explicit Simulator(const SceneModel& model);
    Simulator(const SceneModel& model, const Clock& clock);
    /// Under another budget than the scene's.
    Simulator(const SceneModel& model, const BudgetLimits& limits);
    Simulator(const SceneModel& model, const Clock& clock, const BudgetLimits& limits);

    /// Advances by model.step_s. After a report with finite == false the state is the last good one, and no more steps
    /// are taken.
    const StepReport& step();

    /// The same in two halves. The first is all that the budget does not decide: hands, tissue, dense surfaces, sphere
    /// trees, the free motion of instruments. False: that failed, finish_step() only reports it. Of a step that has begun it only repeats
    /// its answer; a step that has not is not finished: the last report is returned.
    bool begin_step();
    const StepReport& finish_step();
    /// Goes on from another state of this model, or of one that differs from it in settings alone: a fork is restore(other.state()).
    /// A step that has begun here is given up.
    /// fails  BadValue: the state is no state of this model; then nothing has changed
    [[nodiscard]] Result<void> restore(const State& state);

    /// What somebody does while it runs, from the next step on. A scene knows nothing of it: only the same calls at the same
    /// steps repeat such a run.
    /// The hand moves as fast as the instrument's limits allow, towards any finite place.
    /// fails  check_drive_command
    [[nodiscard]] Result<void> set_drive_command(std::size_t instrument, const DriveCommand& wanted);
    /// nullopt lets go. A vertex that no tissue carries is held, and does not move.
    /// fails  check_pull
    [[nodiscard]] Result<void> set_pull(const std::optional<Pull>& pull);
    /// fails  check_limits
    [[nodiscard]] Result<void> set_budget(const BudgetLimits& limits);
    [[nodiscard]] const BudgetLimits& budget() const noexcept { return budget_.limits(); }
    /// What the instrument's route asks for next; nothing where it has none, or where there is no such instrument.
    [[nodiscard]] std::optional<DriveCommand> follow_route(std::size_t instrument);
    /// The model's owner has switched effects: what was kept from step to step is found afresh.
    void effects_changed();

    /// What looks at the exact stage's candidates in place of the CPU twin, on a thread of its own; see ContactSpec::culling. Without
    /// instruments, and of a null pointer, nothing.
    void set_cull_device(std::unique_ptr<collision::CullBackend> device);
    /// Why a device was given up, if one was.
    [[nodiscard]] std::span<const std::string> cull_notes() const noexcept;

    /// Every decision of the clock: recorded from the next step on, or replayed in it (see DecisionTape).
    [[nodiscard]] DecisionTape& tape() noexcept { return budget_.tape(); }

    [[nodiscard]] const SceneModel& model() const noexcept { return model_; }
    /// Evaluates the surfaces that no step has needed: not from several threads at once.
    [[nodiscard]] const State& state() noexcept;
    /// The same, but surfaces that no step has needed may wait there (BodyState::surface_deferred).
    [[nodiscard]] const State& raw_state() const noexcept { return state_; }
    [[nodiscard]] const StepReport& report() const noexcept { return context_.report; }
    /// What the last step's response pushed against: places where an instrument presses on its wall (gap: what is missing
    /// of the clearance), and sphere contacts of solid bodies.
    [[nodiscard]] std::span<const Contact> contacts() const noexcept;
    /// Spheres of the last descent, for pictures: links of an instrument at the end of the step.
    [[nodiscard]] const StepContext& context() const noexcept { return context_; }

private:
    void refuse(const Result<void>& settings);
    void move_everything();
    bool follow_lumens(double after_s);
    void descend();
    void find_exact();
    void refit(std::size_t wall);
    void respond();
    void scale_to_safe_fraction(double fraction);
    [[nodiscard]] double find_free_share(double distance);
    void scale_motion(double fraction);
    void force_exact_stage(std::size_t instrument);
    void retry_with_drive_stopped(std::size_t instrument);
    void forget_forces();
    void list_contacts();
    void check_rods();
    void observe();
    void finish_report();
    [[nodiscard]] bool is_dropped(Droppable effect) const noexcept { return (dropped_ & drop_bit(effect)) != 0; }
    [[nodiscard]] bool any_instrument() const noexcept { return !model_.instruments.empty(); }

    const SceneModel& model_;
    MonotonicClock own_clock_;
    StepBudget budget_;
    State state_;
    StepContext context_;
    unsigned dropped_ = 0; // effects that this step leaves out
    bool stopped_ = false;
    bool begun_ = false; // a step, and not finished it
};

} // namespace trocar::engine
