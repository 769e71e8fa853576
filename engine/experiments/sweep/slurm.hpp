// A sweep as one array job of Slurm: which chunks each task takes, the scripts, what the queue knows of them.
#pragma once

#include "engine/experiments/sweep/forecast.hpp"

#include <filesystem>
#include <set>
#include <string>
#include <vector>

namespace trocar::engine {

struct SlurmOptions {
    std::string partition; // empty: the cluster's own choice
    std::string time;      // of a task, as Slurm writes it; empty: from the forecast
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

/// What earlier submissions still have in the queue.
struct SlurmQueue {
    std::size_t running = 0, waiting = 0; // tasks
    std::set<std::uint64_t> chunks;       // that those tasks will take
    std::string failure;                  // why the queue could not be asked; empty: it could, or there is nothing to ask about
};
[[nodiscard]] SlurmQueue ask_queue(const std::filesystem::path& folder);

} // namespace trocar::engine
