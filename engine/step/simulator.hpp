// One step after another: the engine's loop, and the only way to advance a state.
#pragma once

#include "base/contact.hpp"
#include "base/result.hpp"
#include "engine/prepare/prepared.hpp"
#include "engine/state/inputs.hpp"
#include "engine/state/step_report.hpp"
#include "engine/state/views.hpp"

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace trocar::collision {
class CullBackend;
}
namespace trocar::spheretree {
struct Sphere;
enum class LinkStatus : std::uint8_t;
} // namespace trocar::spheretree

namespace trocar::engine {

class Clock;
class DecisionTape;
class StepProbe;
struct StepScratch;

/// Every public call checks what it is given, and answers: with an Error that says what was found and what is expected, and then nothing
/// has changed; or, where it says so, by doing nothing. Nothing that is refused reaches the state.
class Simulator {
public:
    /// Of a prepared scene, which it shares; under the scene's budget or another.
    explicit Simulator(const Prepared& scene);
    Simulator(const Prepared& scene, const BudgetLimits& limits);
    /// Of a model that is only read and must outlive the simulator. It is one that prepare_scene made; settings that a caller changed in it
    /// (step, effects, contact, budget) are checked, and where no step can be taken with them, or under the budget that is given, none is:
    /// begin_step() returns false, and the report is not finite and says why.
    explicit Simulator(const SceneModel& model);
    Simulator(const SceneModel& model, const Clock& clock);
    Simulator(const SceneModel& model, const BudgetLimits& limits);
    Simulator(const SceneModel& model, const Clock& clock, const BudgetLimits& limits);
    /// Another one of the same model, at the scene's start: what both would build alike is copied instead, some 20 times as fast.
    Simulator(const Simulator& like, const BudgetLimits& limits);
    ~Simulator();
    /// What is moved from can only be assigned to and destroyed.
    Simulator(Simulator&& other) noexcept;
    Simulator& operator=(Simulator&& other) noexcept;

    /// Between steps: another one in the same state, under the same budget. Both go on to the same bits, each on its own.
    [[nodiscard]] Simulator fork();

    /// Advances by model.step_s, as the scene's script says. After a report with finite == false the state is the last good one, and no
    /// more steps are taken.
    const StepReport& step();
    /// The same, with what somebody does during this step. They hold for this step alone.
    /// fails  check_inputs: no step was taken
    [[nodiscard]] Result<void> step(const Inputs& inputs);

    /// A step in two halves. The first is all that the budget does not decide: drive commands, tissue, dense surfaces, sphere trees, the
    /// free motion of instruments. False: that failed, or the inputs are refused (check_inputs) and nothing has begun. Of a step that has
    /// begun it only repeats its answer; a step that has not is not finished: the last report is returned.
    bool begin_step(const Inputs& inputs = {});
    const StepReport& finish_step();

    /// fails  BadValue: a drive command for no instrument or that is not finite, a pull of no vertex or to no place, a share of the breath
    ///        that is not in [0, 1], a budget that check_limits refuses
    [[nodiscard]] Result<void> check_inputs(const Inputs& inputs) const;

    /// All that the last step left: restore(*save()) comes back to it, here or in another simulator. To a file: checkpoint.hpp.
    [[nodiscard]] SavedState save();
    /// Goes on from another state of this model, or of one that differs from it in settings alone.
    /// A step that has begun here is given up.
    /// fails  BadValue: the state is no state of this model; then nothing has changed
    [[nodiscard]] Result<void> restore(const State& state);

    /// What the rule that follows the instrument's route wants next, for whoever drives it with changes of their own; it advances that
    /// rule's part of the state, as a step would. Nothing where there is no route, or no such instrument.
    [[nodiscard]] std::optional<DriveCommand> follow_route(std::size_t instrument);

    /// Of the last step; before the first, what steps will have.
    [[nodiscard]] const BudgetLimits& budget() const noexcept;

    /// What culls the exact stage's candidates in place of the CPU reference, on a thread of its own; see ContactSpec::culling. Without
    /// instruments, and of a null pointer, nothing.
    void set_cull_device(std::unique_ptr<collision::CullBackend> device);
    /// Why a device was given up, if one was.
    [[nodiscard]] std::span<const std::string> cull_notes() const noexcept;

    /// Is told of the parts of every step from now on (step_probe.hpp), and must outlive that; nullptr: nobody is. Forks have none.
    void set_probe(StepProbe* probe) noexcept;

    /// Every decision of the clock: recorded from the next step on, or replayed in it (see DecisionTape).
    [[nodiscard]] DecisionTape& tape() noexcept;

    [[nodiscard]] std::size_t body_count() const noexcept;
    [[nodiscard]] std::size_t instrument_count() const noexcept;
    /// Nothing where there is none of that name.
    [[nodiscard]] std::optional<std::size_t> find_body(std::string_view name) const noexcept;
    [[nodiscard]] std::optional<std::size_t> find_instrument(std::string_view name) const noexcept;
    /// As the last step left it; empty where there is no such index. It holds until the next step. A body's surface is evaluated where no
    /// step has needed it: not from several threads at once.
    [[nodiscard]] BodyView body(std::size_t index) noexcept;
    [[nodiscard]] InstrumentView instrument(std::size_t index) const noexcept;
    /// hash_state: where everything is.
    [[nodiscard]] std::uint64_t hash() noexcept;

    [[nodiscard]] const SceneModel& model() const noexcept;
    /// Evaluates the surfaces that no step has needed: not from several threads at once.
    [[nodiscard]] const State& state() noexcept;
    /// The same, but surfaces that no step has needed may wait there (BodyState::surface_deferred).
    [[nodiscard]] const State& raw_state() const noexcept;
    [[nodiscard]] const StepReport& report() const noexcept;
    /// What the last step's response pushed against: places where an instrument presses on its wall (gap: what is missing
    /// of the clearance), and sphere contacts of solid bodies.
    [[nodiscard]] std::span<const Contact> contacts() const noexcept;
    /// What the last step's traversal found, sphere by sphere: pairs that touch, and those that its budget left untested.
    [[nodiscard]] std::span<const Contact> sphere_contacts() const noexcept;
    /// A sphere of a solid body's tree over the last step; null where the body has none, or where the step did not need it.
    [[nodiscard]] const spheretree::Sphere* find_sphere(std::size_t body, Index sphere) const noexcept;
    /// [links] what the last step's traversal proved of an instrument's links, tip first; empty: nothing.
    [[nodiscard]] std::span<const spheretree::LinkStatus> link_status(std::size_t instrument) const noexcept;

private:
    friend struct ScratchView; // of tests that look at one stage
    struct Parts;
    explicit Simulator(std::unique_ptr<Parts> parts) noexcept;
    [[nodiscard]] StepScratch& scratch() noexcept;

    std::unique_ptr<Parts> parts_;
};

} // namespace trocar::engine
