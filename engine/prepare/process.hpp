// Runs one external program to its end, to a time limit, or until an interruption, without a shell. Neither it nor anything that
// it started outlives us, whatever ends us (supervisor.hpp).
#pragma once

#include "base/result.hpp"
#include "engine/time/interrupt.hpp"

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace trocar::engine {

struct ProcessOutcome {
    bool timed_out = false;
    bool interrupted = false; // then it was killed, too
    int exit_code = -1;       // when it ended by itself
    int signal = 0;           // when it was killed by one
    std::string output;       // the last few KiB of stdout and stderr together
};

/// Absolute path of a program in PATH (or of a path given as such); MissingTool otherwise.
[[nodiscard]] Result<std::filesystem::path> find_program(const std::string& name, const std::string& package);

/// What a request to end (engine/time/interrupt.hpp) means to a program that runs.
enum class OnInterrupt : std::uint8_t {
    Kill,
    Finish // it is short, and part of what an interrupted run writes
};

/// Runs in `folder`; at the limit, s of a monotonic clock, it is killed with all that it started. What it prints is read as it comes: the
/// last few KiB are kept, nothing is written. ToolFailed only when it could not be started.
[[nodiscard]] Result<ProcessOutcome> run_process(const std::filesystem::path& program, const std::vector<std::string>& arguments,
                                                 const std::filesystem::path& folder, double time_limit,
                                                 OnInterrupt on_interrupt = OnInterrupt::Kill);

/// A sentence where the system leaves such a program less than kToolMemory; empty otherwise.
[[nodiscard]] std::string tell_memory_limit();

/// A private folder under the system's temporary one, removed with everything in it when this goes, also when interrupted.
class TemporaryFolder {
public:
    [[nodiscard]] static Result<TemporaryFolder> make();
    TemporaryFolder(TemporaryFolder&& other) noexcept;
    TemporaryFolder& operator=(TemporaryFolder&&) = delete;
    ~TemporaryFolder();
    [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }

private:
    TemporaryFolder(std::filesystem::path path, InterruptHold hold) : hold_(std::move(hold)), path_(std::move(path)) {}
    InterruptHold hold_; // goes last
    std::filesystem::path path_;
};

} // namespace trocar::engine
