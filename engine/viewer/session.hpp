// An interactive run of a scene: commands in, steps on. No network, no clock of its own, no thread: what it does in work mode
// follows from the commands and the steps between which they came.
#pragma once

#include "engine/effects/contrast/contrast.hpp"
#include "engine/prepare/prepare_scene.hpp"
#include "engine/state/state.hpp"
#include "engine/step/simulator.hpp"
#include "engine/viewer/command.hpp"
#include "engine/viewer/recording.hpp"
#include "engine/viewer/saved_states.hpp"

#include <array>
#include <functional>
#include <memory>
#include <optional>

namespace trocar::engine::viewer {

/// What the page shows beside the step's report.
struct SessionStatus {
    bool paused = false;
    bool script = false; // the scene's own script drives
    bool grabbed = false;
    bool stepped = false; // the simulator's report is of a step: not of a state that a run began with, or went back to
    double pace = 1.0;
    Drive drive;
    BudgetLimits budget;
    std::array<bool, kMostEffects> effects{}; // as registered_effects(): on
    std::optional<effects::Injection> injection; // of this run, by the scene or by command; none: it has no contrast
    SavedMarks saved;
};

/// A state that was saved, with what the simulation needs beside it to go on with the same bits.
struct Saved {
    SavedMark mark;
    SavedState state;
    SessionStatus status;
    LiveEffects live;
    DriveCommand drive_position;
    std::shared_ptr<const Recording> recording; // of the run until then, and after it; null: no instrument
    Recording::Mark recorded;
};

class Session {
public:
    /// scene, prepared  must outlive it; prepared is the scene's
    /// equip            sees the simulator of every run before its first step, to give it what the scene alone does not
    Session(const Scene& scene, const PreparedScene& prepared, std::function<void(Simulator&)> equip = {});

    /// Between two steps. Restart, SaveState and RestoreState are the only commands that allocate.
    void apply(const Command& command);
    /// Is a step due: not paused, or asked for one by one?
    [[nodiscard]] bool wants_step() const noexcept { return (!status_.paused || single_steps_ > 0) && !stopped(); }
    const StepReport& step();

    [[nodiscard]] bool stopped() const noexcept { return !simulator_->report().finite; }
    [[nodiscard]] const Simulator& simulator() const noexcept { return *simulator_; }
    [[nodiscard]] Simulator& simulator() noexcept { return *simulator_; }
    [[nodiscard]] const SceneModel& model() const noexcept { return model_; }
    [[nodiscard]] const SessionStatus& status() const noexcept { return status_; }
    /// Largest distance between an untested pair's stand-in and what it stands for, m; 0 where nothing is assumed.
    [[nodiscard]] double assumed_error_m() const noexcept;
    /// Tests a step, as mode Work counts them, with which the exact stage fits as it does without a limit: what the scene's size lets
    /// one expect, or twice what any step has taken so far.
    [[nodiscard]] std::uint64_t work_enough() const noexcept;
    /// Restart begins another one; readers of the last one keep it alive.
    [[nodiscard]] const std::shared_ptr<Recording>& recording() const noexcept { return recording_; }
    [[nodiscard]] std::uint64_t run() const noexcept { return run_; } // counts restarts, and states gone back to
    /// nullptr: there is no such one
    [[nodiscard]] const Saved* find_saved(std::uint32_t id) const noexcept;

    /// The scene has this effect, so that it can be switched off and on.
    [[nodiscard]] bool permits(const EffectDescriptor& effect) const noexcept { return permitted_[index_of(effect)]; }
    [[nodiscard]] bool has_script() const noexcept { return has_script_; }
    [[nodiscard]] bool has_instrument() const noexcept { return !model_.instruments.empty(); }

private:
    void begin_run();
    [[nodiscard]] std::shared_ptr<Recording> begin_recording() const;
    void follow_drive_command();
    [[nodiscard]] DriveCommand wanted_drive_command();
    void inject();
    void save(const StateName& name);
    void restore(const Saved& saved);
    void list_saved() noexcept;
    void switch_effect(const EffectDescriptor& effect, bool on);
    void fade_effects();

    const Scene& scene_;
    SceneModel model_; // the scene's, whose first instrument is driven
    Inputs inputs_;    // of the next step
    std::vector<DriveRow> script_; // of the first instrument
    bool has_script_ = false;
    std::optional<effects::Injection> injection_; // the scene's own
    std::array<bool, kMostEffects> permitted_{};
    std::function<void(Simulator&)> equip_;
    std::optional<Simulator> simulator_;
    std::shared_ptr<Recording> recording_;
    SessionStatus status_;
    DriveCommand drive_position_;         // drive position in the last step
    std::optional<DriveCommand> goal_;    // of DriveTo
    unsigned single_steps_ = 0;
    std::vector<Saved> saved_; // the oldest first
    std::uint32_t saves_ = 0;
    std::uint64_t run_ = 0;
    std::uint64_t most_work_ = 0; // of a step so far, all runs together
};

} // namespace trocar::engine::viewer
