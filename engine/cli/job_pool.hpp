// The same program several times at once: jobs that wait for a slot, run, and are collected.
#pragma once

#include "base/result.hpp"

#include <string>
#include <sys/types.h>
#include <vector>

namespace trocar::engine {

/// In such a child, first of all: it ends when its parent does, also by a SIGKILL, after which the pool cannot interrupt its jobs. What it
/// had finished by then is kept.
/// parent  its process, as the parent itself has named it: it may have ended before this was called
void end_with_parent(pid_t parent) noexcept;

/// Children print their errors on our standard error; their standard output is dropped. All are interrupted when the pool goes.
class JobPool {
public:
    /// jobs     arguments of this program, one list per job
    /// at_once  processes that run at a time, >= 1
    JobPool(std::vector<std::vector<std::string>> jobs, std::size_t at_once);
    ~JobPool();
    JobPool(const JobPool&) = delete;
    JobPool& operator=(const JobPool&) = delete;

    /// Collects jobs that have ended and starts those that wait; never blocks.
    void tick();
    /// Has the job ended?
    [[nodiscard]] bool is_done(std::size_t job) const noexcept { return jobs_[job].state == JobState::Done; }
    [[nodiscard]] bool is_running(std::size_t job) const noexcept { return jobs_[job].state == JobState::Runs; }
    /// Of a job that has ended by itself; 0 of all others.
    [[nodiscard]] int exit_code(std::size_t job) const noexcept { return jobs_[job].exit_code; }
    /// fails  ToolFailed: it could not be started, was killed, or ended with another code than 0
    [[nodiscard]] Result<void> outcome(std::size_t job) const;

private:
    enum class JobState { Waits, Runs, Done };
    struct Job {
        std::vector<std::string> arguments;
        JobState state = JobState::Waits;
        pid_t process = 0;
        std::string failure;
        int exit_code = 0;
    };
    void start(Job& job);
    void look_at(Job& job, int options);
    std::vector<Job> jobs_;
    std::size_t at_once_;
};

} // namespace trocar::engine
