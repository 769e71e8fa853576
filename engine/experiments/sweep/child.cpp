#include "engine/experiments/sweep/child.hpp"

#include "engine/time/clock.hpp"
#include "engine/time/interrupt.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <csignal>
#include <cstring>

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

namespace trocar::engine {
namespace {

constexpr int kLookMs = 100; // between looks at an interruption and the time limit

/// In the child: async-signal-safe calls only.
[[noreturn]] void become(char* const* words, const char* folder, int log, pid_t parent) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    const int nothing = ::open("/dev/null", O_RDONLY);
    const bool ready = getppid() == parent && nothing >= 0 && ::dup2(nothing, STDIN_FILENO) >= 0 && ::dup2(log, STDOUT_FILENO) >= 0 &&
                       ::dup2(log, STDERR_FILENO) >= 0 && ::chdir(folder) == 0;
    if (ready) ::execv("/proc/self/exe", words);
    _exit(127);
}

/// Until the child has ended or some time has passed.
void wait_a_while(int child) {
    if (child < 0) { // a kernel without such descriptors
        ::poll(nullptr, 0, 2);
        return;
    }
    pollfd one{child, POLLIN, 0};
    ::poll(&one, 1, kLookMs);
}

} // namespace

Result<ChildEnd> run_this_program(const std::vector<std::string>& arguments, const std::filesystem::path& folder, const std::filesystem::path& log,
                                  double time_limit) {
    std::vector<std::string> words{"trocar"};
    words.insert(words.end(), arguments.begin(), arguments.end());
    std::vector<char*> pointers;
    for (std::string& word : words) pointers.push_back(word.data());
    pointers.push_back(nullptr);
    const int output = ::open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    if (output < 0) return Error{ErrorCode::CannotWrite, fmt::format("cannot be written: {}", std::strerror(errno)), log.string()};
    const pid_t us = getpid();
    const std::string place = folder.string();
    const pid_t child = ::fork();
    if (child == 0) become(pointers.data(), place.c_str(), output, us);
    const int reason = errno;
    ::close(output);
    if (child < 0) return Error{ErrorCode::ToolFailed, fmt::format("a run could not be started: {}", std::strerror(reason))};
    const int handle = static_cast<int>(::syscall(SYS_pidfd_open, child, 0));
    ChildEnd end;
    const StopWatch watch;
    int status = 0;
    for (pid_t ended = 0; ended != child;) {
        ended = ::waitpid(child, &status, WNOHANG);
        if (ended == child) break;
        if (ended < 0 && errno != EINTR) return Error{ErrorCode::ToolFailed, fmt::format("a run was lost: {}", std::strerror(errno))};
        if (!end.timed_out && !end.interrupted) {
            end.interrupted = interrupt_requested();
            end.timed_out = !end.interrupted && time_limit > 0.0 && 1e-3 * watch.elapsed_ms() >= time_limit;
            if (end.interrupted || end.timed_out) ::kill(child, SIGKILL);
        }
        wait_a_while(handle);
    }
    if (handle >= 0) ::close(handle);
    if (WIFEXITED(status)) end.exit_code = WEXITSTATUS(status);
    if (WIFSIGNALED(status)) end.signal = WTERMSIG(status);
    return end;
}

} // namespace trocar::engine
