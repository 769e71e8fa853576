#include "engine/prepare/process.hpp"

#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <fcntl.h>
#include <fstream>
#include <optional>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#include <utility>

extern char** environ;

namespace seldinger::engine {

namespace {

constexpr long kPollNanoseconds = 5'000'000;     // between two looks at the child
constexpr rlim_t kMemoryLimit = rlim_t{8} << 30; // bytes of address space: a runaway mesher must not take the machine
constexpr std::streamoff kOutputTail = 4096;     // bytes of the program's last words that are kept
constexpr const char* kLogName = "seldinger-tool.log";

Error tool_failed(std::string message) { return {.code = ErrorCode::ToolFailed, .message = std::move(message)}; }

bool is_program(const std::filesystem::path& path) {
    std::error_code ignored;
    return std::filesystem::is_regular_file(path, ignored) && access(path.c_str(), X_OK) == 0;
}

std::string read_tail(const std::filesystem::path& path) {
    std::ifstream in(path, std::ios::binary | std::ios::ate);
    if (!in) return {};
    const std::streamoff size = in.tellg();
    in.seekg(size > kOutputTail ? size - kOutputTail : 0);
    return {std::istreambuf_iterator<char>(in), {}};
}

/// In the child, between fork and exec: system calls alone. Returns only when one failed; errno says why.
void become(const char* program, char* const* words, const char* folder, pid_t parent, const sigset_t& mask) {
    const rlimit memory{kMemoryLimit, kMemoryLimit}, no_core{0, 0};
    if (prctl(PR_SET_PDEATHSIG, SIGKILL) != 0) return; // whatever ends the parent ends this too
    if (getppid() != parent) _exit(1);                 // it ended before the line above
    if (setpgid(0, 0) != 0 || setrlimit(RLIMIT_AS, &memory) != 0 || setrlimit(RLIMIT_CORE, &no_core) != 0 || chdir(folder) != 0) return;
    const int nothing = open("/dev/null", O_RDONLY), log = open(kLogName, O_WRONLY | O_CREAT | O_TRUNC, 0600);
    if (nothing < 0 || log < 0 || dup2(nothing, STDIN_FILENO) < 0) return;
    if (dup2(log, STDOUT_FILENO) < 0 || dup2(log, STDERR_FILENO) < 0) return;
    sigprocmask(SIG_SETMASK, &mask, nullptr);
    execve(program, words, environ);
}

/// Starts the program in its own process group with its output in the log, or returns the system's reason.
Result<pid_t> start(const std::filesystem::path& program, const std::vector<std::string>& arguments, const std::filesystem::path& folder) {
    std::vector<std::string> words{program.string()};
    words.insert(words.end(), arguments.begin(), arguments.end());
    std::vector<char*> pointers;
    for (std::string& word : words) pointers.push_back(word.data());
    pointers.push_back(nullptr);

    const auto failed = [&](int reason) { return tool_failed("could not start " + program.string() + ": " + std::strerror(reason)); };
    int pipe_ends[2]; // closed by exec: what comes through it is the reason why there was none
    if (pipe2(pipe_ends, O_CLOEXEC) != 0) return failed(errno);
    sigset_t all, mask;
    sigfillset(&all);
    sigprocmask(SIG_SETMASK, &all, &mask); // our handlers are none of the child's business
    const pid_t parent = getpid(), child = fork();
    if (child == 0) {
        become(program.c_str(), pointers.data(), folder.c_str(), parent, mask);
        const int reason = errno;
        _exit(write(pipe_ends[1], &reason, sizeof reason) == sizeof reason ? 126 : 127);
    }
    const int not_forked = errno;
    sigprocmask(SIG_SETMASK, &mask, nullptr);
    close(pipe_ends[1]);
    int reason = 0;
    ssize_t told = 0;
    while (child > 0 && (told = read(pipe_ends[0], &reason, sizeof reason)) < 0 && errno == EINTR) {
    }
    close(pipe_ends[0]);
    if (child < 0) return failed(not_forked);
    if (told > 0) {
        waitpid(child, nullptr, 0);
        return failed(reason);
    }
    return child;
}

/// The child's status, or nothing when the limit or an interruption came first. Counts its own naps, each at least the nominal one.
std::optional<int> wait_for(pid_t child, double time_limit, OnInterrupt on_interrupt) {
    const double naps = std::ceil(time_limit * 1e9 / kPollNanoseconds);
    for (double nap = 0.0; nap <= naps; ++nap) {
        int status = 0;
        const pid_t ended = waitpid(child, &status, WNOHANG);
        if (ended == child) return status;
        if (ended < 0 && errno != EINTR) return 0;
        if (on_interrupt == OnInterrupt::Kill && interrupt_requested()) break;
        const timespec pause{0, kPollNanoseconds};
        nanosleep(&pause, nullptr);
    }
    return std::nullopt;
}

} // namespace

Result<std::filesystem::path> find_program(const std::string& name, const std::string& package) {
    const Error missing{.code = ErrorCode::MissingTool, .message = name + " is not installed; on Debian: apt-get install " + package};
    if (name.find('/') != std::string::npos) {
        if (is_program(name)) return std::filesystem::absolute(name);
        return missing;
    }
    const char* path = std::getenv("PATH");
    std::string folders = path ? path : "/usr/local/bin:/usr/bin:/bin";
    for (std::size_t begin = 0; begin <= folders.size();) {
        const std::size_t end = std::min(folders.find(':', begin), folders.size());
        const std::filesystem::path candidate = std::filesystem::path(folders.substr(begin, end - begin)) / name;
        if (end > begin && is_program(candidate)) return std::filesystem::absolute(candidate);
        begin = end + 1;
    }
    return missing;
}

Result<ProcessOutcome> run_process(const std::filesystem::path& program, const std::vector<std::string>& arguments,
                                   const std::filesystem::path& folder, double time_limit, OnInterrupt on_interrupt) {
    const InterruptHold hold(InterruptHold::Then::End);
    const Result<pid_t> child = start(program, arguments, folder);
    if (!child) return child.error();
    ProcessOutcome outcome;
    std::optional<int> status = wait_for(*child, time_limit, on_interrupt);
    if (!status) {
        outcome.interrupted = on_interrupt == OnInterrupt::Kill && interrupt_requested();
        outcome.timed_out = !outcome.interrupted;
        kill(-*child, SIGKILL);
        int ended = 0;
        while (waitpid(*child, &ended, 0) < 0 && errno == EINTR) {
        }
        status = ended;
    }
    if (WIFEXITED(*status)) outcome.exit_code = WEXITSTATUS(*status);
    if (WIFSIGNALED(*status)) outcome.signal = WTERMSIG(*status);
    outcome.output = read_tail(folder / kLogName);
    return outcome;
}

Result<TemporaryFolder> TemporaryFolder::make() {
    InterruptHold hold(InterruptHold::Then::End); // from before the folder is there
    std::error_code failure;
    const std::filesystem::path parent = std::filesystem::temp_directory_path(failure);
    std::string name = ((failure ? std::filesystem::path("/tmp") : parent) / "seldinger-XXXXXX").string();
    if (!mkdtemp(name.data()))
        return Error{.code = ErrorCode::CannotWrite, .message = "no temporary folder: " + std::string(std::strerror(errno)), .file = name};
    return TemporaryFolder(name, std::move(hold));
}

TemporaryFolder::TemporaryFolder(TemporaryFolder&& other) noexcept : hold_(std::move(other.hold_)), path_(std::exchange(other.path_, {})) {}

TemporaryFolder::~TemporaryFolder() {
    std::error_code ignored;
    if (!path_.empty()) std::filesystem::remove_all(path_, ignored);
}

} // namespace seldinger::engine
