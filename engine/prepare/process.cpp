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
#include <spawn.h>
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

/// Starts the program in its own process group with its output in the log, or returns the system's reason.
Result<pid_t> start(const std::filesystem::path& program, const std::vector<std::string>& arguments, const std::filesystem::path& folder) {
    std::vector<std::string> words{program.string()};
    words.insert(words.end(), arguments.begin(), arguments.end());
    std::vector<char*> pointers;
    for (std::string& word : words) pointers.push_back(word.data());
    pointers.push_back(nullptr);

    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addchdir_np(&actions, folder.c_str());
    posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, kLogName, O_WRONLY | O_CREAT | O_TRUNC, 0600);
    posix_spawn_file_actions_adddup2(&actions, STDOUT_FILENO, STDERR_FILENO);
    posix_spawnattr_t attributes;
    posix_spawnattr_init(&attributes);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
    posix_spawnattr_setpgroup(&attributes, 0);
    pid_t child = 0;
    const int failure = posix_spawn(&child, program.c_str(), &actions, &attributes, pointers.data(), environ);
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&actions);
    if (failure != 0) return tool_failed("could not start " + program.string() + ": " + std::strerror(failure));
    const rlimit memory{kMemoryLimit, kMemoryLimit}, no_core{0, 0};
    prlimit(child, RLIMIT_AS, &memory, nullptr);
    prlimit(child, RLIMIT_CORE, &no_core, nullptr);
    return child;
}

/// The child's status, or nothing when the limit passed first. Counts its own naps, each at least the nominal one.
std::optional<int> wait_for(pid_t child, double time_limit) {
    const double naps = std::ceil(time_limit * 1e9 / kPollNanoseconds);
    for (double nap = 0.0; nap <= naps; ++nap) {
        int status = 0;
        const pid_t ended = waitpid(child, &status, WNOHANG);
        if (ended == child) return status;
        if (ended < 0 && errno != EINTR) return 0;
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
                                   const std::filesystem::path& folder, double time_limit) {
    const Result<pid_t> child = start(program, arguments, folder);
    if (!child) return child.error();
    ProcessOutcome outcome;
    std::optional<int> status = wait_for(*child, time_limit);
    if (!status) {
        outcome.timed_out = true;
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
    std::error_code failure;
    const std::filesystem::path parent = std::filesystem::temp_directory_path(failure);
    std::string name = ((failure ? std::filesystem::path("/tmp") : parent) / "seldinger-XXXXXX").string();
    if (!mkdtemp(name.data()))
        return Error{.code = ErrorCode::CannotWrite, .message = "no temporary folder: " + std::string(std::strerror(errno)), .file = name};
    return TemporaryFolder(name);
}

TemporaryFolder::TemporaryFolder(TemporaryFolder&& other) noexcept : path_(std::exchange(other.path_, {})) {}

TemporaryFolder::~TemporaryFolder() {
    std::error_code ignored;
    if (!path_.empty()) std::filesystem::remove_all(path_, ignored);
}

} // namespace seldinger::engine
