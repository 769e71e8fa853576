#include "engine/prepare/process.hpp"

#include "engine/prepare/supervisor.hpp"
#include "engine/time/clock.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#include <utility>

namespace trocar::engine {

namespace {

constexpr int kLook = 20; // ms between two polls of the clock and of the requests to end

bool is_program(const std::filesystem::path& path) {
    std::error_code ignored;
    return std::filesystem::is_regular_file(path, ignored) && access(path.c_str(), X_OK) == 0;
}

Error could_not_start(const std::filesystem::path& program, const std::string& reason) {
    return {.code = ErrorCode::ToolFailed, .message = "could not start " + program.string() + ": " + reason};
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
    Result<SupervisedProcess> process = SupervisedProcess::start(program, arguments, folder);
    if (!process) return process.error();
    using News = SupervisedProcess::News;
    ProcessOutcome outcome;
    const StopWatch watch;
    News news = News::None;
    while ((news = process->wait(kLook)) == News::None) {
        if (outcome.interrupted || outcome.timed_out) continue; // it is being ended
        outcome.interrupted = on_interrupt == OnInterrupt::Kill && interrupt_requested();
        outcome.timed_out = !outcome.interrupted && 1e-3 * watch.elapsed_ms() >= time_limit;
        if (outcome.interrupted || outcome.timed_out) process->end_all();
    }
    if (news == News::NotStarted) return could_not_start(program, std::strerror(process->status()));
    const bool ended_by_us = outcome.interrupted || outcome.timed_out;
    if (news == News::Lost && !ended_by_us) return could_not_start(program, "the process that watches over it was killed");
    if (news == News::Ended && WIFEXITED(process->status())) outcome.exit_code = WEXITSTATUS(process->status());
    if (news == News::Ended && WIFSIGNALED(process->status())) outcome.signal = WTERMSIG(process->status());
    outcome.output = process->output();
    return outcome;
}

std::string tell_memory_limit() {
    rlimit limit{};
    if (getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur >= kToolMemory) return {};
    return fmt::format("its memory is limited to {} MiB by the system (ulimit -v), expected {} or more where that is the cause",
                       limit.rlim_cur >> 20, kToolMemory >> 20);
}

Result<TemporaryFolder> TemporaryFolder::make() {
    InterruptHold hold(InterruptHold::Then::End); // from before the folder is there
    std::error_code failure;
    const std::filesystem::path parent = std::filesystem::temp_directory_path(failure);
    std::string name = ((failure ? std::filesystem::path("/tmp") : parent) / "trocar-XXXXXX").string();
    if (!mkdtemp(name.data()))
        return Error{.code = ErrorCode::CannotWrite, .message = "no temporary folder: " + std::string(std::strerror(errno)), .file = name};
    return TemporaryFolder(name, std::move(hold));
}

TemporaryFolder::TemporaryFolder(TemporaryFolder&& other) noexcept : hold_(std::move(other.hold_)), path_(std::exchange(other.path_, {})) {}

TemporaryFolder::~TemporaryFolder() {
    std::error_code ignored;
    if (!path_.empty()) std::filesystem::remove_all(path_, ignored);
}

} // namespace trocar::engine
