#include "engine/prepare/supervisor.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <ctime>
#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/signalfd.h>
#include <sys/wait.h>
#include <unistd.h>
#include <utility>

extern char** environ;

namespace trocar::engine {

namespace {

constexpr rlim_t kMemoryLimit = kToolMemory;   // bytes of address space: a runaway mesher must not exhaust the machine
constexpr rlim_t kFileLimit = rlim_t{4} << 30; // of any file that it writes
constexpr std::size_t kOutputTail = 4096;      // bytes of the program's last output that are kept
constexpr int kFirstFreeFd = 3;                // after the standard streams
constexpr int kEndingRounds = 500;             // looks for what is left, one every kEndingNap: then it is left to the system
constexpr long kEndingNap = 4'000'000;         // ns

/// From the supervisor, or from the program's process before it became the program.
struct Message {
    SupervisedProcess::News news;
    int status;
};

/// What the processes after fork need: nothing there may allocate memory.
struct Plan {
    const char* program;
    char* const* words;
    const char* folder;
    sigset_t mask; // of the program's signals
    int control, news, output;
};

struct Pipe {
    int read = -1, write = -1;
};

void close_fd(int& fd) noexcept {
    if (fd >= 0) close(fd);
    fd = -1;
}

/// Both ends closed by exec, and none in the place of a standard stream, whichever of those our caller has closed.
bool make_pipe(Pipe& made) noexcept {
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) return false;
    for (int& end : ends)
        if (const int moved = end < kFirstFreeFd ? fcntl(end, F_DUPFD_CLOEXEC, kFirstFreeFd) : end; moved != end) {
            close(end);
            end = moved;
        }
    made = {ends[0], ends[1]};
    return made.read >= 0 && made.write >= 0;
}

// ---- In the processes after fork: system calls alone.

/// Ours, or less where less is allowed already: a hard limit can only be lowered without privileges.
bool lower_limit(int resource, rlim_t most) noexcept {
    rlimit limit{};
    if (getrlimit(resource, &limit) != 0) return false;
    limit.rlim_cur = std::min(limit.rlim_cur, most);
    limit.rlim_max = std::min(limit.rlim_max, most);
    return setrlimit(resource, &limit) == 0;
}

bool tell(int fd, SupervisedProcess::News news, int status) noexcept {
    const Message message{news, status};
    return write(fd, &message, sizeof message) == sizeof message;
}

/// Returns only when a call failed; errno says why.
void become(const Plan& plan, pid_t parent) noexcept {
    if (prctl(PR_SET_PDEATHSIG, SIGKILL) != 0) return; // whatever ends the supervisor ends this too
    if (getppid() != parent) _exit(1);                 // it ended before the line above
    if (setpgid(0, 0) != 0 || chdir(plan.folder) != 0) return;
    if (!lower_limit(RLIMIT_AS, kMemoryLimit) || !lower_limit(RLIMIT_FSIZE, kFileLimit) || !lower_limit(RLIMIT_CORE, 0)) return;
    if (dup2(plan.output, STDOUT_FILENO) < 0 || dup2(plan.output, STDERR_FILENO) < 0) return;
    sigprocmask(SIG_SETMASK, &plan.mask, nullptr);
    execve(plan.program, plan.words, environ);
}

/// Everything but the standard streams and these three.
void close_others(std::array<int, 3> kept) noexcept {
    std::sort(kept.begin(), kept.end());
    unsigned next = kFirstFreeFd;
    for (const int fd : kept) {
        if (static_cast<unsigned>(fd) > next) close_range(next, static_cast<unsigned>(fd) - 1, 0);
        next = static_cast<unsigned>(fd) + 1;
    }
    close_range(next, ~0U, 0);
}

/// Every child that there is, with its group: also those that came to the subreaper when their parent ended.
void kill_children() noexcept {
    const int file = open("/proc/thread-self/children", O_RDONLY | O_CLOEXEC);
    if (file < 0) return; // a system without this list: the program's own group was killed
    char text[512];
    pid_t id = 0;
    for (ssize_t count; (count = read(file, text, sizeof text)) > 0;)
        for (ssize_t i = 0; i < count; ++i)
            if (text[i] >= '0' && text[i] <= '9') {
                id = 10 * id + (text[i] - '0');
            } else {
                if (id > 1 && kill(-id, SIGKILL) != 0) kill(id, SIGKILL);
                id = 0;
            }
    close(file);
}

/// Collects who has ended. True once the program is among them; then `status` is its.
bool reap(pid_t program, int& status, bool& any_left) noexcept {
    bool found = false;
    for (;;) {
        int its = 0;
        const pid_t ended = waitpid(-1, &its, WNOHANG);
        if (ended < 0 && errno == EINTR) continue;
        any_left = ended == 0;
        if (ended <= 0) return found;
        if (ended == program) {
            found = true;
            status = its;
        }
    }
}

/// Until none is left: a killed process's children are reparented to us, and are killed next.
bool end_everybody(pid_t program, int& status) noexcept {
    bool ended = false, any_left = true;
    for (int round = 0; round < kEndingRounds; ++round) {
        kill(-program, SIGKILL);
        kill_children();
        ended |= reap(program, status, any_left);
        if (!any_left) return ended;
        const timespec nap{0, kEndingNap};
        nanosleep(&nap, nullptr);
    }
    return ended;
}

/// All signals are blocked here: signals of a terminal are handled by the program's owner.
[[noreturn]] void supervise(const Plan& plan) noexcept {
    setpgid(0, 0);
    std::signal(SIGCHLD, SIG_DFL); // ignored, children would go without a status
    prctl(PR_SET_CHILD_SUBREAPER, 1);
    const int nothing = open("/dev/null", O_RDWR);
    for (int stream = 0; stream < kFirstFreeFd; ++stream)
        if (nothing >= 0 && nothing != stream) dup2(nothing, stream);
    close_others({plan.control, plan.news, plan.output});
    sigset_t children;
    sigemptyset(&children);
    sigaddset(&children, SIGCHLD);
    const int ends = signalfd(-1, &children, SFD_CLOEXEC | SFD_NONBLOCK);
    const pid_t self = getpid(), program = fork();
    if (program == 0) {
        become(plan, self);
        (void)tell(plan.news, SupervisedProcess::News::NotStarted, errno);
        _exit(127);
    }
    if (program < 0) {
        (void)tell(plan.news, SupervisedProcess::News::NotStarted, errno);
        _exit(1);
    }
    close(plan.output);
    int status = 0;
    bool ended = false, any_left = true;
    while (!ended) {
        pollfd fds[2] = {{plan.control, POLLIN, 0}, {ends, POLLIN, 0}};
        constexpr int kWithoutSignals = 50; // ms, where there is no descriptor for them
        if (poll(fds, ends >= 0 ? 2 : 1, ends >= 0 ? -1 : kWithoutSignals) > 0 && fds[0].revents != 0) break;
        signalfd_siginfo seen;
        while (ends >= 0 && read(ends, &seen, sizeof seen) == sizeof seen) {
        }
        ended = reap(program, status, any_left);
    }
    ended |= end_everybody(program, status);
    if (ended) (void)tell(plan.news, SupervisedProcess::News::Ended, status);
    _exit(0);
}

// ---- In the program's owner.

Error not_made(const std::filesystem::path& program, int reason) {
    return {.code = ErrorCode::ToolFailed, .message = "could not start " + program.string() + ": " + std::strerror(reason)};
}

} // namespace

Result<SupervisedProcess> SupervisedProcess::start(const std::filesystem::path& program, const std::vector<std::string>& arguments,
                                                   const std::filesystem::path& folder) {
    std::vector<std::string> words{program.string()};
    words.insert(words.end(), arguments.begin(), arguments.end());
    std::vector<char*> pointers;
    for (std::string& word : words) pointers.push_back(word.data());
    pointers.push_back(nullptr);

    SupervisedProcess process;
    Pipe control, news, output;
    const bool piped = make_pipe(control) && make_pipe(news) && make_pipe(output);
    const int no_pipe = errno;
    process.control_ = control.write;
    process.news_ = news.read;
    process.output_ = output.read;
    if (piped) {
        fcntl(output.read, F_SETFL, O_NONBLOCK);
        Plan plan{program.c_str(), pointers.data(), folder.c_str(), {}, control.read, news.write, output.write};
        sigset_t all;
        sigfillset(&all);
        pthread_sigmask(SIG_SETMASK, &all, &plan.mask); // our handlers must not be inherited
        process.supervisor_ = fork();
        if (process.supervisor_ == 0) supervise(plan);
        const int not_forked = errno;
        pthread_sigmask(SIG_SETMASK, &plan.mask, nullptr);
        errno = not_forked;
    }
    const int reason = piped ? errno : no_pipe;
    for (int* end : {&control.read, &news.write, &output.write}) close_fd(*end);
    if (process.supervisor_ < 0) return not_made(program, reason);
    return process;
}

SupervisedProcess::SupervisedProcess(SupervisedProcess&& other) noexcept
    : supervisor_(std::exchange(other.supervisor_, -1)), control_(std::exchange(other.control_, -1)), news_(std::exchange(other.news_, -1)),
      output_(std::exchange(other.output_, -1)), status_(other.status_), tail_(std::move(other.tail_)) {}

SupervisedProcess::~SupervisedProcess() {
    end_all();
    close_fd(news_);
    close_fd(output_);
    while (supervisor_ > 0 && waitpid(supervisor_, nullptr, 0) < 0 && errno == EINTR) {
    }
}

void SupervisedProcess::end_all() noexcept { close_fd(control_); }

/// One buffer at a time: a program that prints for ever must not block the other events.
void SupervisedProcess::take_output() {
    constexpr int kPieces = 64;
    std::array<char, 4096> piece;
    for (int k = 0; k < kPieces; ++k) {
        const ssize_t count = read(output_, piece.data(), piece.size());
        if (count <= 0) return;
        tail_.append(piece.data(), static_cast<std::size_t>(count));
        if (tail_.size() > 4 * kOutputTail) tail_.erase(0, tail_.size() - kOutputTail);
    }
}

SupervisedProcess::News SupervisedProcess::take_news() {
    Message message{};
    ssize_t count = 0;
    while ((count = read(news_, &message, sizeof message)) < 0 && errno == EINTR) {
    }
    if (count != sizeof message) return News::Lost;
    status_ = message.status;
    return message.news;
}

SupervisedProcess::News SupervisedProcess::wait(int milliseconds) {
    pollfd fds[2] = {{news_, POLLIN, 0}, {output_, POLLIN, 0}};
    if (poll(fds, 2, milliseconds) <= 0) return News::None;
    News news = News::None;
    if (fds[0].revents != 0) news = take_news();
    take_output(); // after the status: all that was printed before it has arrived
    if (news == News::None && fds[0].revents == 0 && (fds[1].revents & (POLLHUP | POLLIN)) == POLLHUP) {
        pollfd alone{news_, POLLIN, 0}; // it closed its outputs and goes on
        if (poll(&alone, 1, milliseconds) > 0) news = take_news();
    }
    return news;
}

std::string SupervisedProcess::output() const { return tail_.size() > kOutputTail ? tail_.substr(tail_.size() - kOutputTail) : tail_; }

} // namespace trocar::engine
