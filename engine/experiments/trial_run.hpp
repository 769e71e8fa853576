// What a step and a run will cost, from a few steps that are tried.
#pragma once

#include "engine/state/state.hpp"
#include "engine/state/step_report.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace trocar::engine {

/// Steps that are tried out: enough to pass the first steps' allocations.
inline constexpr std::uint64_t kTrialSteps = 30;
/// Steps before that of a trial whose instruments were laid along their routes: until they lean on the walls.
inline constexpr std::uint64_t kSettlingSteps = 30;
/// A heavy scene's trial ends after so long; fewer steps tell nothing.
inline constexpr double kTrialTime = 5e3; // ms
inline constexpr std::uint64_t kFewestSteps = 3;

struct Trial {
    std::vector<double> total, collision; // ms, of every step
    StepReport last;

    /// Median; reorders.
    [[nodiscard]] static double middle(std::vector<double>& values);
};

/// from      a state to go on from; none: the start
/// settling  steps that do not count, as far as there is time for them
/// limit_ms  of each part
[[nodiscard]] Trial try_steps(const SceneModel& model, const std::optional<State>& from, std::uint64_t settling, std::uint64_t steps, double limit_ms);

/// ms of a step of a run of so many steps: `first` is a trial from its start, `late` one with instruments laid along their routes, or empty.
[[nodiscard]] double mean_step_ms(const SceneModel& model, Trial& first, Trial& late, std::uint64_t steps);

struct RunForecast {
    double step_ms = 0.0, run_s = 0.0; // without preparation
    double memory_mb = 0.0;            // most that this process has used so far
    std::string failure;               // why the trial stopped; empty: it did not
};

/// steps  of the run
[[nodiscard]] RunForecast forecast_run(const SceneModel& model, std::uint64_t steps, double limit_ms);

} // namespace trocar::engine
