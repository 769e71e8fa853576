// A process between us and a program that we run. It holds one end of a pipe; when ours closes, because we ask for it or because
// something ended us (a SIGKILL too), it ends the program and everything that came of it, also what left the program's group.
//
// PR_SET_PDEATHSIG alone reaches a child, not a child's children: those lose their parent and live on. The supervisor is their
// subreaper (prctl(2)): a process beneath it that loses its parent becomes its child, and can be found and ended.
#pragma once

#include "base/result.hpp"

#include <filesystem>
#include <optional>
#include <string>
#include <sys/types.h>
#include <vector>

namespace trocar::engine {

/// Bytes of address space that a supervised program may have, or what the system leaves us where that is less.
inline constexpr std::uint64_t kToolMemory = std::uint64_t{8} << 30;

/// A program that runs under a supervisor. Not for two threads.
class SupervisedProcess {
public:
    /// In `folder`, with both outputs in one pipe. fails  ToolFailed: no process, no pipe
    [[nodiscard]] static Result<SupervisedProcess> start(const std::filesystem::path& program, const std::vector<std::string>& arguments,
                                                         const std::filesystem::path& folder);
    SupervisedProcess(SupervisedProcess&& other) noexcept;
    SupervisedProcess& operator=(SupervisedProcess&&) = delete;
    /// Ends what still runs.
    ~SupervisedProcess();

    enum class News : std::uint8_t {
        None,       // it runs
        Ended,      // status() says how
        NotStarted, // status() is the system's reason
        Lost,       // the supervisor ended without a status; the program ends with it
    };
    /// Waits for a status or for at most `milliseconds`, and takes what the program has printed meanwhile.
    [[nodiscard]] News wait(int milliseconds);
    /// Kills the program and all that came of it. wait() then returns the status.
    void end_all() noexcept;
    /// As waitpid gives it, or the system's reason.
    [[nodiscard]] int status() const noexcept { return status_; }
    /// The last few KiB of both outputs; however much the program prints, no more is kept.
    [[nodiscard]] std::string output() const;

private:
    SupervisedProcess() = default;
    void take_output();
    [[nodiscard]] News take_news();

    pid_t supervisor_ = -1;
    int control_ = -1; // write end: closing it ends the program
    int news_ = -1, output_ = -1;
    int status_ = 0;
    std::string tail_;
};

} // namespace trocar::engine
