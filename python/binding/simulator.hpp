// A simulator as Python holds it: with its scene, the drive commands that hold until they are changed, and surfaces that views look at.
#pragma once

#include "engine/fluoroscopy/observation.hpp"
#include "engine/step/simulator.hpp"
#include "python/binding/errors.hpp"
#include "python/binding/loaded_scene.hpp"

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

namespace trocar::python {

/// Speeds of an instrument's handle, held from step to step.
struct DriveRate {
    double speed = 0.0; // m/s of insertion
    double turn = 0.0;  // rad/s
};
using DriveRates = std::vector<std::optional<DriveRate>>; // [instrument_count] none: the scene's script

/// All that a simulator needs to go on to the same bits. Immutable.
struct SavedState {
    ScenePtr scene; // null: read from bytes, and not yet used
    std::shared_ptr<const engine::State> state;
    DriveRates drives;
    std::string checkpoint; // checkpoint_bytes; of one that was read from bytes
};

class PySimulator {
public:
    PySimulator(ScenePtr scene, const engine::BudgetLimits& limits);
    ~PySimulator();
    PySimulator(const PySimulator&) = delete;
    PySimulator& operator=(const PySimulator&) = delete;

    [[nodiscard]] const ScenePtr& scene() const noexcept { return scene_; }
    [[nodiscard]] const engine::SceneModel& model() const noexcept { return scene_->model(); }

    /// Holds until changed. none: the scene's script drives again.
    /// fails  no such instrument, a number that is not finite
    void drive(std::size_t instrument, std::optional<DriveRate> rate);
    [[nodiscard]] DriveRates drives();

    /// Steps until the count is done or the state is no longer finite.
    /// between   called every kStepsBetween steps with the lock given back; may throw
    /// fails     StoppedError: a step before has failed
    engine::StepReport step(std::uint64_t count, const std::function<void()>& between);
    [[nodiscard]] engine::StepReport report();

    [[nodiscard]] std::uint64_t hash();
    [[nodiscard]] SavedState save();
    /// fails  of another scene or build, changed bytes
    void load(const SavedState& saved);
    [[nodiscard]] std::unique_ptr<PySimulator> fork();
    [[nodiscard]] std::vector<Contact> contacts();
    /// The X-ray frame of a view of the scene's outputs.fluoroscopy as the state stands. Empty: its first, or the whole patient from the
    /// front where it has none.
    /// fails  no such view, a source inside a body
    [[nodiscard]] engine::GreyFrame render(const std::string& view);

    /// All that this frame says.
    [[nodiscard]] engine::XrayObservation observe(const std::string& view);

    /// Memory that stays where it is for as long as the simulator lives, and follows its steps.
    [[nodiscard]] std::span<const Vec3> rod(std::size_t instrument);
    [[nodiscard]] std::span<const Vec3> skin(std::size_t instrument);
    [[nodiscard]] std::span<const Vec3> surface(std::size_t body);

    [[nodiscard]] const engine::BudgetLimits& budget() const noexcept { return limits_; }

    static constexpr std::uint64_t kStepsBetween = 32;

private:
    /// One thread at a time; the others wait.
    class Use;
    void take_step(engine::Inputs& inputs);
    void follow_surfaces();
    [[nodiscard]] const engine::InstrumentState& instrument(std::size_t index) const;

    ScenePtr scene_;
    engine::BudgetLimits limits_;
    std::unique_ptr<engine::Simulator> simulator_;
    DriveRates drives_;
    engine::Inputs inputs_;
    /// [body] what a view of a surface that moves looks at: the engine keeps two and exchanges them. Empty: nobody looks.
    std::vector<std::vector<Vec3>> watched_;
    bool any_watched_ = false;
    struct Cameras; // made by the first picture
    [[nodiscard]] engine::Fluoroscope& find_scope(const std::string& view, const engine::State& state);
    std::unique_ptr<Cameras> cameras_;
    std::timed_mutex mutex_;
    std::atomic<int> user_process_{0}; // that holds the mutex
};

} // namespace trocar::python
