// What Slurm knows of the tasks that a sweep has submitted: those in its queue, and how those that it ended have ended.
#pragma once

#include "base/result.hpp"

#include <cstdint>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace trocar::engine {

struct SlurmQueue {
    std::size_t running = 0, waiting = 0; // tasks
    std::set<std::uint64_t> chunks;       // that those tasks will take
    std::set<std::string> held_jobs;      // with tasks that wait until somebody releases them
    std::string failure;                  // why the queue could not be asked; empty: it could, or there is nothing to ask about
    /// State that Slurm gives (TIMEOUT, OUT_OF_MEMORY, ...) -> chunks of tasks that came to it, where no later task has them.
    std::map<std::string, std::set<std::uint64_t>> ended;
    std::set<std::uint64_t> unknown; // chunks of tasks that have left the queue, and nobody can be asked how
    std::string unknown_reason;      // what sacct said
};
/// Asks squeue, which remembers a task for some minutes (MinJobAge), and then sacct, where there is accounting.
[[nodiscard]] SlurmQueue ask_queue(const std::filesystem::path& folder);

/// "2 tasks running, 1 waiting", and what lets tasks go on that Slurm holds.
[[nodiscard]] std::string queued_text(const SlurmQueue& queue);

/// Lines on tasks that ended without their results, for the status of a sweep.
/// incomplete  chunks that miss a result
[[nodiscard]] std::string ended_text(const SlurmQueue& queue, const std::vector<std::uint64_t>& incomplete);

/// Output of a command of Slurm that ended well.
/// fails  MissingTool, ToolFailed with what it said
[[nodiscard]] Result<std::string> call_slurm(const char* tool, const std::vector<std::string>& arguments, const std::filesystem::path& folder);

/// FOLDER/slurm/NUMBER-NAME, and the first number that no submission has.
[[nodiscard]] std::filesystem::path slurm_file(const std::filesystem::path& folder, int number, const char* name);
[[nodiscard]] int next_submission(const std::filesystem::path& folder);

} // namespace trocar::engine
