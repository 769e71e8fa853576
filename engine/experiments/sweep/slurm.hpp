// A sweep as one array job of Slurm: which chunks each task takes, and the scripts.
#pragma once

#include "engine/experiments/sweep/forecast.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace trocar::engine {

struct SlurmOptions {
    std::string partition; // empty: the cluster's own choice
    std::string time;      // of a task, as Slurm writes it; empty: from the forecast
    double memory_mb = 0.0; // of a task; 0: from the forecast
};

/// Chunks of every task, contiguous, each about two minutes long and at most `most_tasks` in all.
[[nodiscard]] std::vector<std::vector<std::uint64_t>> group_chunks(const SweepPlan& plan, const std::vector<std::uint64_t>& chunks, double run_s,
                                                                   std::uint64_t most_tasks);

/// What sbatch is given: the preparation of the scenes, and the array that waits for it.
struct SlurmScripts {
    std::string prepare, array, tasks; // tasks: a line of chunks for each, by task number from 1
};
/// number   of this submission in the folder: names of its files
/// program  absolute path
[[nodiscard]] SlurmScripts write_scripts(const std::filesystem::path& folder, int number, const std::filesystem::path& program,
                                         const std::vector<std::vector<std::uint64_t>>& tasks, const SweepForecast& forecast, const SlurmOptions& options);

struct SlurmJob {
    int number = 0;
    std::string prepare_id, array_id;
};

/// Writes the scripts into the folder and submits them.
/// fails  MissingTool without sbatch, ToolFailed with what it said, CannotWrite
[[nodiscard]] Result<SlurmJob> submit(const std::filesystem::path& folder, const SweepPlan& plan, const std::vector<std::uint64_t>& chunks,
                                      const std::filesystem::path& program, const SweepForecast& forecast, const SlurmOptions& options);

} // namespace trocar::engine
