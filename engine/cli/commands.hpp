// The program's commands. Each returns its exit code: 0 fine; 2 bad usage or input; 3 a state left its bounds; 4 a budget
// was missed and --fail-on-overrun was given; 5 a run differs from its reference or its record; 130 interrupted.
#pragma once

#include "base/result.hpp"

#include <functional>

namespace CLI {
class App;
}

namespace seldinger::engine {

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
[[nodiscard]] Command add_schema_command(CLI::App& app);
[[nodiscard]] Command add_prepare_command(CLI::App& app);
[[nodiscard]] Command add_bench_command(CLI::App& app);
[[nodiscard]] Command add_ccd_command(CLI::App& app);
[[nodiscard]] Command add_contacts_command(CLI::App& app);

/// Parses the command line and runs what it asks for.
[[nodiscard]] int run_program(int argc, char** argv);

/// "error: file:line:column: key: message" on standard error; returns kExitBadInput.
int report_error(const Error& error);

} // namespace seldinger::engine
