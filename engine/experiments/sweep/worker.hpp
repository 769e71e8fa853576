// Runs what is missing of a chunk, one run after another: the same on one machine and in a task of a cluster.
#pragma once

#include "engine/experiments/sweep/result_store.hpp"

namespace trocar::engine {

struct ChunkEnd {
    std::uint64_t done = 0;    // runs that this call has finished, failed ones too
    std::uint64_t killed = 0;  // runs that somebody killed: they are missing
    bool interrupted = false;  // between two runs or in one, which is missing then
};

/// folder  of the sweep
/// fails   CannotWrite, ToolFailed: not the run's fault; what was finished before is kept
[[nodiscard]] Result<ChunkEnd> run_chunk(const std::filesystem::path& folder, const SweepPlan& plan, std::uint64_t chunk);

/// The row of a run whose outputs are in `out`.
/// status  as the table has it
[[nodiscard]] RunResult collect_run(const SweepPlan& plan, const PlannedRun& run, const std::filesystem::path& out, std::string status);

/// Scratch folders of workers that are gone.
void remove_old_scratch(const std::filesystem::path& folder);

} // namespace trocar::engine
