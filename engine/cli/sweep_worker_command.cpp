// What `sweep` starts: one process runs the missing runs of some chunks. The same on this machine, in a task of Slurm, over ssh.
#include "engine/cli/commands.hpp"
#include "engine/cli/job_pool.hpp"
#include "engine/experiments/sweep/forecast.hpp"
#include "engine/experiments/sweep/worker.hpp"
#include "engine/time/interrupt.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <cstdio>
#include <memory>

namespace trocar::engine {

namespace {

struct WorkerOptions {
    std::filesystem::path folder;
    std::vector<std::uint64_t> chunks;
    std::int64_t parent = 0;
    bool prepare = false; // every scene into the cache, nothing else
};

int work(const WorkerOptions& options) {
    if (options.chunks.empty() && !options.prepare)
        return report_error({ErrorCode::BadUsage, "expected --chunk with numbers, or --prepare", {}, 0, 0, "sweep-worker"});
    if (options.parent > 0) {
        end_with_parent(static_cast<pid_t>(options.parent));
        answer_interrupts_silently();
    }
    std::error_code failed;
    const std::filesystem::path folder = std::filesystem::absolute(options.folder, failed).lexically_normal();
    const auto plan = read_plan(folder / sweep_name::kPlan);
    if (!plan) return report_error(plan.error());
    if (plan->program != program_version())
        return report_error({ErrorCode::BadValue,
                             fmt::format("was made by {}, and this is {}; expected the same program", plan->program, program_version()),
                             (folder / sweep_name::kPlan).string()});
    if (const auto same = check_unchanged(*plan); !same) return report_error(same.error());
    if (options.prepare) {
        const auto prepared = prepare_scenes(*plan, [](const std::string&) {});
        return prepared ? kExitFine : report_error(prepared.error());
    }
    const InterruptHold hold(InterruptHold::Then::OwnerEnds); // finished runs are kept
    std::uint64_t killed = 0;
    for (const std::uint64_t chunk : options.chunks) {
        if (chunk >= plan->chunk_count())
            return report_error({ErrorCode::BadUsage, fmt::format("found {}; expected 0 to {}", chunk, plan->chunk_count() - 1), {}, 0, 0, "--chunk"});
        const auto ended = run_chunk(folder, *plan, chunk);
        if (!ended) return report_error(ended.error());
        if (ended->interrupted) return kExitInterrupted;
        killed += ended->killed;
    }
    if (killed > 0)
        return report_error({ErrorCode::ToolFailed, fmt::format("{} runs were killed from outside or could not be started: they are missing", killed), folder.string()});
    return kExitFine;
}

} // namespace

Command add_sweep_worker_command(CLI::App& app) {
    const auto options = std::make_shared<WorkerOptions>();
    CLI::App* command = app.add_subcommand("sweep-worker", "Run the missing runs of some chunks of a sweep's folder")->group("");
    command->add_option("folder", options->folder, "a sweep's --out")->required();
    command->add_option("--chunk", options->chunks, "numbers of chunks, from 0")->delimiter(',');
    command->add_flag("--prepare", options->prepare, "prepare every scene for the cache, and run nothing");
    command->add_option("--parent", options->parent)->group("");
    return {command, [options] { return work(*options); }};
}

} // namespace trocar::engine
