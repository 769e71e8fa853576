#include "engine/cli/job_pool.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <fcntl.h>
#include <spawn.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

extern char** environ;

namespace trocar::engine {

void end_with_parent(pid_t parent) noexcept {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent) _exit(1); // it ended before the line above
}

JobPool::JobPool(std::vector<std::vector<std::string>> jobs, std::size_t at_once) : at_once_(std::max<std::size_t>(at_once, 1)) {
    for (auto& arguments : jobs) jobs_.emplace_back().arguments = std::move(arguments);
}

JobPool::~JobPool() {
    for (const Job& job : jobs_)
        if (job.state == JobState::Runs) kill(job.process, SIGINT);
    for (Job& job : jobs_)
        while (job.state == JobState::Runs) look_at(job, 0);
}

void JobPool::start(Job& job) {
    std::vector<std::string> words{"trocar"};
    words.insert(words.end(), job.arguments.begin(), job.arguments.end());
    std::vector<char*> pointers;
    for (std::string& word : words) pointers.push_back(word.data());
    pointers.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
    const int failed = posix_spawn(&job.process, "/proc/self/exe", &actions, nullptr, pointers.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    job.state = failed == 0 ? JobState::Runs : JobState::Done;
    if (failed != 0) job.failure = fmt::format("could not be started: {}", std::strerror(failed));
}

/// options  0 waits for its end, WNOHANG does not
void JobPool::look_at(Job& job, int options) {
    int status = 0;
    const pid_t ended = waitpid(job.process, &status, options);
    if (ended == 0 || (ended < 0 && errno == EINTR)) return;
    job.state = JobState::Done;
    if (ended < 0)
        job.failure = fmt::format("was lost: {}", std::strerror(errno));
    else if (WIFSIGNALED(status))
        job.failure = fmt::format("was killed by signal {}", WTERMSIG(status));
    else if (job.exit_code = WEXITSTATUS(status); job.exit_code != 0)
        job.failure = fmt::format("ended with exit code {}", WEXITSTATUS(status));
}

void JobPool::tick() {
    std::size_t running = 0;
    for (Job& job : jobs_) {
        if (job.state == JobState::Runs) look_at(job, WNOHANG);
        running += job.state == JobState::Runs;
    }
    for (Job& job : jobs_) {
        if (running >= at_once_) return;
        if (job.state != JobState::Waits) continue;
        start(job);
        running += job.state == JobState::Runs;
    }
}

Result<void> JobPool::outcome(std::size_t job) const {
    if (jobs_[job].failure.empty()) return {};
    std::string command = "trocar";
    for (const std::string& word : jobs_[job].arguments) command += " " + word;
    return Error{ErrorCode::ToolFailed, fmt::format("a process that shared the work {}: {}", jobs_[job].failure, command)};
}

} // namespace trocar::engine
