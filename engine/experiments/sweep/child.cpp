#include "engine/experiments/sweep/child.hpp"

#include "engine/time/clock.hpp"
#include "engine/time/interrupt.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <utility>

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

namespace trocar::engine {
namespace {

constexpr int kLookMs = 100; // between looks at an interruption and the time limit

constexpr std::size_t kMostOutput = std::size_t{1} << 18; // bytes of a child's output that are kept: its end

/// What a child prints. A pipe, because a file would be lost on a full disk, and with it why the child failed.
class Output {
public:
    Output() {
        if (::pipe2(ends_, O_CLOEXEC) == 0) (void)::fcntl(ends_[0], F_SETFL, O_NONBLOCK);
    }
    ~Output() {
        end_writing();
        end_reading();
    }
    Output(const Output&) = delete;
    Output& operator=(const Output&) = delete;
    [[nodiscard]] bool made() const noexcept { return ends_[1] >= 0; }
    [[nodiscard]] int reader() const noexcept { return ends_[0]; }
    [[nodiscard]] int writer() const noexcept { return ends_[1]; }
    void end_writing() noexcept {
        if (ends_[1] >= 0) ::close(std::exchange(ends_[1], -1));
    }
    /// Takes what has come; does not wait.
    void read() {
        char bytes[4096];
        while (ends_[0] >= 0) {
            const ssize_t count = ::read(ends_[0], bytes, sizeof bytes);
            if (count < 0 && errno == EINTR) continue;
            if (count < 0 && errno == EAGAIN) return;
            if (count <= 0) return end_reading();
            text_.append(bytes, static_cast<std::size_t>(count));
            if (text_.size() > 2 * kMostOutput) text_.erase(0, text_.size() - kMostOutput);
        }
    }
    [[nodiscard]] std::string take() { return std::move(text_); }

private:
    void end_reading() noexcept {
        if (ends_[0] >= 0) ::close(std::exchange(ends_[0], -1));
    }
    int ends_[2] = {-1, -1};
    std::string text_;
};

/// In the child: async-signal-safe calls only.
[[noreturn]] void become(char* const* words, const char* folder, int output, pid_t parent) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    const int nothing = ::open("/dev/null", O_RDONLY);
    const bool ready = getppid() == parent && nothing >= 0 && ::dup2(nothing, STDIN_FILENO) >= 0 && ::dup2(output, STDOUT_FILENO) >= 0 &&
                       ::dup2(output, STDERR_FILENO) >= 0 && ::chdir(folder) == 0;
    if (ready) ::execv("/proc/self/exe", words);
    _exit(127);
}

/// Until the child has ended or printed something, or some time has passed. A negative descriptor is waited for in vain.
void wait_a_while(int child, int output) {
    pollfd both[] = {{child, POLLIN, 0}, {output, POLLIN, 0}};
    ::poll(both, 2, child < 0 ? 2 : kLookMs); // 2 ms on a kernel without such descriptors
}

} // namespace

Result<ChildEnd> run_this_program(const std::vector<std::string>& arguments, const std::filesystem::path& folder, double time_limit) {
    std::vector<std::string> words{"trocar"};
    words.insert(words.end(), arguments.begin(), arguments.end());
    std::vector<char*> pointers;
    for (std::string& word : words) pointers.push_back(word.data());
    pointers.push_back(nullptr);
    Output output;
    if (!output.made()) return Error{ErrorCode::ToolFailed, fmt::format("a run could not be started: {}", std::strerror(errno))};
    const pid_t us = getpid();
    const std::string place = folder.string();
    const pid_t child = ::fork();
    if (child == 0) become(pointers.data(), place.c_str(), output.writer(), us);
    const int reason = errno;
    output.end_writing();
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
        wait_a_while(handle, output.reader());
        output.read();
    }
    output.read();
    end.output = output.take();
    if (handle >= 0) ::close(handle);
    if (WIFEXITED(status)) end.exit_code = WEXITSTATUS(status);
    if (WIFSIGNALED(status)) end.signal = WTERMSIG(status);
    return end;
}

} // namespace trocar::engine
