// The program's commands. Each returns its exit code: 0 fine; 2 bad usage or input; 3 a state left its bounds; 4 a budget
// was missed and --fail-on-overrun was given; 130 interrupted.
#pragma once

#include "base/result.hpp"

#include <cstdint>
#include <filesystem>
#include <string>

namespace seldinger::engine {

enum ExitCode : int { kExitFine = 0, kExitBadInput = 2, kExitNotFinite = 3, kExitOverrun = 4, kExitInterrupted = 130 };

struct RunOptions {
    std::filesystem::path scene;
    std::filesystem::path out;     // empty: out/<scene name>
    std::int64_t steps = -1;       // < 0: as the scene says
    std::string budget;            // empty: as the scene says
    std::filesystem::path path;    // CSV that replaces the first instrument's script
    bool record = false, force = false, fail_on_overrun = false, pictures = true, quiet = false;
};

[[nodiscard]] int run_command(const RunOptions& options);

struct ExplainOptions {
    std::filesystem::path scene;
};
[[nodiscard]] int explain_command(const ExplainOptions& options);

/// JSON Schema of scenes on standard output.
[[nodiscard]] int schema_command();

/// Parses the command line and runs what it asks for.
[[nodiscard]] int run_program(int argc, char** argv);

/// "error: file:line:column: key: message" on standard error; returns kExitBadInput.
int report_error(const Error& error);

} // namespace seldinger::engine
