// The program's commands. Each returns its exit code: 0 fine; 2 bad usage or input, or an output that cannot be written; 3 a state left
// its bounds; 4 a budget was missed and --fail-on-overrun was given; 5 an answer differs from its reference or its record, or misses a
// contact that is known; 130 interrupted.
#pragma once

#include "base/result.hpp"
#include "engine/cli/bench_request.hpp"

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace trocar::engine {

enum ExitCode : int { kExitFine = 0, kExitBadInput = 2, kExitNotFinite = 3, kExitOverrun = 4, kExitDiffers = 5, kExitInterrupted = 130 };

/// A subcommand: its options, and what runs when the command line names it. One file each.
struct Command {
    CLI::App* app = nullptr;
    std::function<int()> run;
};

[[nodiscard]] Command add_run_command(CLI::App& app);
[[nodiscard]] Command add_view_command(CLI::App& app);
[[nodiscard]] Command add_plan_command(CLI::App& app);
[[nodiscard]] Command add_cost_command(CLI::App& app);
[[nodiscard]] Command add_verify_command(CLI::App& app);
[[nodiscard]] Command add_explain_command(CLI::App& app);
[[nodiscard]] Command add_film_command(CLI::App& app);
[[nodiscard]] Command add_episode_command(CLI::App& app);
[[nodiscard]] Command add_score_command(CLI::App& app);
[[nodiscard]] Command add_schema_command(CLI::App& app);
[[nodiscard]] Command add_devices_command(CLI::App& app);
[[nodiscard]] Command add_sweep_command(CLI::App& app);
[[nodiscard]] Command add_sweep_worker_command(CLI::App& app); // what a sweep runs on this machine or another
[[nodiscard]] Command add_import_command(CLI::App& app);
[[nodiscard]] Command add_prepare_command(CLI::App& app);
[[nodiscard]] Command add_bench_command(CLI::App& app, AnswerBench answer);
[[nodiscard]] Command add_ccd_command(CLI::App& app);
[[nodiscard]] Command add_contacts_command(CLI::App& app);
[[nodiscard]] Command add_docs_command(CLI::App& app); // `app` outlives it: the pages are about it

/// Parses the command line and runs what it asks for.
/// answer_bench  `trocar bench`; here another program does
[[nodiscard]] int run_program(int argc, char** argv, AnswerBench answer_bench = become_bench_program);

/// Would the program take this command line? Nothing runs.
/// words  without the program's name
[[nodiscard]] Result<void> check_command_line(std::vector<std::string> words);

/// "error: file:line:column: key: message" on standard error; returns kExitBadInput.
int report_error(const Error& error);

/// A line on standard error. One that is closed or full loses it and ends nothing, where fmt::print throws.
void print_to_stderr(const std::string& line);
/// "notice: SENTENCE" there.
void report_notice(const std::string& sentence);

/// Outputs of one command, written one after another: one that fails does not prevent the others, and the exit code reports it.
class WrittenOutputs {
public:
    /// An error is reported at once.
    void note(const Result<void>& written) {
        ++outputs_;
        if (written.ok()) return;
        report_error(written.error());
        ++missing_;
    }
    [[nodiscard]] bool all_there() const noexcept { return missing_ == 0; }
    /// Reports how many of how many are in `place`, where some are missing. Returns kExitFine, or kExitBadInput.
    [[nodiscard]] int tell(const std::filesystem::path& place) const;

private:
    std::size_t outputs_ = 0, missing_ = 0;
};

} // namespace trocar::engine
