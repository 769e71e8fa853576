#include "engine/experiments/sweep/slurm.hpp"

#include "engine/experiments/sweep/result_store.hpp"
#include "engine/experiments/sweep/slurm_queue.hpp"
#include "engine/io/atomic_file.hpp"
#include "engine/prepare/process.hpp"
#include "engine/report/places.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <sstream>

namespace trocar::engine {
namespace {

namespace fs = std::filesystem;

constexpr double kTask_s = 120.0;           // that a task is to take: 100 empty tasks cost 46 s of a queue on one node
constexpr double kTimeFactor = 4.0;         // of the forecast, that a task may take
constexpr double kLeastTime_s = 600.0;      // a task's limit is never less
constexpr double kMemoryFactor = 1.5, kLeastMemory_mb = 512.0;
constexpr std::uint64_t kUsualArray = 1000; // tasks; Slurm's own MaxArraySize is 1001

std::string head(const std::string& name, const SlurmOptions& options) {
    std::string text = fmt::format("#!/bin/sh\n#SBATCH --job-name={}\n#SBATCH --open-mode=append\n#SBATCH --requeue\n"
                                   "#SBATCH --ntasks=1\n#SBATCH --cpus-per-task=1\n",
                                   name);
    if (!options.partition.empty()) text += fmt::format("#SBATCH --partition={}\n", options.partition);
    return text;
}

/// minutes, as Slurm takes them
std::string time_text(double s) { return fmt::format("{:.0f}", std::ceil(std::max(s, kLeastTime_s) / 60.0)); }

std::uint64_t find_array_limit(const fs::path& folder) {
    const auto said = call_slurm("scontrol", {"show", "config"}, folder);
    if (!said) return kUsualArray;
    const std::size_t at = said->find("MaxArraySize");
    if (at == std::string::npos) return kUsualArray;
    const std::size_t digits = said->find_first_of("0123456789", at);
    std::uint64_t size = 0;
    if (digits != std::string::npos) std::from_chars(said->data() + digits, said->data() + said->size(), size);
    return size > 1 ? size - 1 : kUsualArray;
}

/// The job's number in what `sbatch --parsable` prints.
Result<std::string> submit_script(const fs::path& script, const std::vector<std::string>& more, const fs::path& folder) {
    std::vector<std::string> arguments{"--parsable"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    arguments.push_back(script.string());
    const auto said = call_slurm("sbatch", arguments, folder);
    if (!said) return said.error();
    std::istringstream lines(*said);
    std::string id;
    for (std::string line; std::getline(lines, line);)
        if (const std::string word = line.substr(0, line.find(';')); !word.empty() && word.find_first_not_of("0123456789") == std::string::npos) id = word;
    if (id.empty()) return Error{ErrorCode::ToolFailed, fmt::format("sbatch gave no number of a job: {:.200}", *said)};
    return id;
}

} // namespace

std::vector<std::vector<std::uint64_t>> group_chunks(const SweepPlan& plan, const std::vector<std::uint64_t>& chunks, double run_s, std::uint64_t most_tasks) {
    const double chunk_s = std::max(run_s, 1e-3) * static_cast<double>(plan.chunk_runs);
    const std::uint64_t by_time = static_cast<std::uint64_t>(std::max(1.0, std::floor(kTask_s / chunk_s)));
    const std::uint64_t by_limit = (chunks.size() + most_tasks - 1) / std::max<std::uint64_t>(most_tasks, 1);
    const std::uint64_t each = std::max<std::uint64_t>({by_time, by_limit, 1});
    std::vector<std::vector<std::uint64_t>> tasks;
    for (std::size_t i = 0; i < chunks.size(); ++i) {
        if (i % each == 0) tasks.emplace_back();
        tasks.back().push_back(chunks[i]);
    }
    return tasks;
}

SlurmScripts write_scripts(const fs::path& folder, int number, const fs::path& program, const std::vector<std::vector<std::uint64_t>>& tasks,
                           const SweepForecast& forecast, const SlurmOptions& options) {
    SlurmScripts scripts;
    std::size_t longest = 0;
    for (const auto& chunks : tasks) {
        scripts.tasks += fmt::format("{}\n", fmt::join(chunks, ","));
        longest = std::max(longest, chunks.size());
    }
    const double memory_mb = options.memory_mb > 0.0 ? options.memory_mb : std::max(kLeastMemory_mb, kMemoryFactor * forecast.memory_mb);
    const std::string memory = fmt::format("#SBATCH --mem={:.0f}M\n", memory_mb);
    const std::string worker = fmt::format("exec {} sweep-worker {}", shell_quoted(program.string()), shell_quoted(folder.string()));
    scripts.prepare = head("trocar-prepare", options) + memory +
                      fmt::format("#SBATCH --time={}\n{} --prepare\n", time_text(0.0), worker);
    double chunk_runs = 0.0;
    if (const auto plan = read_plan(folder / sweep_name::kPlan)) chunk_runs = static_cast<double>(plan->chunk_runs);
    const double task_s = kTimeFactor * std::max(forecast.run_s, forecast.longest_s) * chunk_runs * static_cast<double>(longest);
    scripts.array = head("trocar-sweep", options) + memory +
                    fmt::format("#SBATCH --time={}\n#SBATCH --array=1-{}\n", options.time.empty() ? time_text(task_s) : options.time, tasks.size()) +
                    fmt::format("chunks=$(sed -n \"${{SLURM_ARRAY_TASK_ID}}p\" {})\n{} --chunk \"$chunks\"\n",
                                shell_quoted(slurm_file(folder, number, "tasks").string()), worker);
    return scripts;
}

Result<SlurmJob> submit(const fs::path& folder, const SweepPlan& plan, const std::vector<std::uint64_t>& chunks, const fs::path& program,
                        const SweepForecast& forecast, const SlurmOptions& options) {
    if (const auto there = find_program("sbatch", "slurm-client"); !there) return there.error();
    for (const std::string& word : {options.partition, options.time})
        if (word.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-:.,") != std::string::npos)
            return Error{ErrorCode::BadUsage, fmt::format("found \"{:.60}\"; expected letters, digits and - _ : . ,", word), {}, 0, 0, "--slurm"};
    if (folder.string().find_first_of("%\\\n\r") != std::string::npos)
        return Error{ErrorCode::BadUsage, "Slurm would take a part of this name for its own; expected a folder without %, \\ and line ends", folder.string()};
    SlurmJob job;
    job.number = next_submission(folder);
    const auto tasks = group_chunks(plan, chunks, forecast.run_s, find_array_limit(folder));
    const SlurmScripts scripts = write_scripts(folder, job.number, program, tasks, forecast, options);
    std::error_code failed;
    const fs::path logs = folder / sweep_name::kSlurm / "logs";
    fs::create_directories(logs, failed);
    const fs::path prepare = slurm_file(folder, job.number, "prepare.sh"), array = slurm_file(folder, job.number, "array.sh");
    for (const auto& [file, text] : {std::pair{slurm_file(folder, job.number, "tasks"), scripts.tasks}, {prepare, scripts.prepare}, {array, scripts.array}})
        if (auto written = write_file_atomically(file, text); !written) return written.error();
    auto prepared = submit_script(prepare, {"--output=" + (logs / fmt::format("{}-prepare.log", job.number)).string()}, folder);
    if (!prepared) return prepared.error();
    job.prepare_id = *prepared;
    // also where the preparation failed: then each run says what is wrong with it
    auto submitted = submit_script(
        array, {"--dependency=afterany:" + job.prepare_id, "--output=" + (logs / fmt::format("{}-%a.log", job.number)).string()}, folder);
    if (!submitted) return submitted.error();
    job.array_id = *submitted;
    if (auto written = write_file_atomically(slurm_file(folder, job.number, "job"), job.array_id + "\n"); !written) return written.error();
    return job;
}

} // namespace trocar::engine
