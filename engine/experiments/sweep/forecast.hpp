// How long a sweep will take, and in how much memory: from trials of its scenes.
#pragma once

#include "engine/experiments/sweep/sweep_plan.hpp"
#include "engine/prepare/prepare_scene.hpp"

namespace trocar::engine {

struct SweepForecast {
    double run_s = 0.0;     // s of one run, on average, with what it takes to start it
    double longest_s = 0.0; // of those that were tried
    double memory_mb = 0.0; // of the largest
    std::size_t tried = 0;  // runs; 0: nothing is known
    std::string failure;    // the first run that could not be prepared, and why
};

/// Tries the first and the last run of every scene, a second each beside their preparation, which the cache then has.
[[nodiscard]] SweepForecast forecast_sweep(const SweepPlan& plan, const Progress& progress);

/// Prepares every scene of the plan once, so that its runs find it in the cache.
/// fails  as prepare_scene
[[nodiscard]] Result<void> prepare_scenes(const SweepPlan& plan, const Progress& progress);

/// A run's scene, as its command reads it.
[[nodiscard]] Result<Scene> scene_of(const SweepPlan& plan, const PlannedRun& run);

} // namespace trocar::engine
