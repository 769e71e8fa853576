// The folder of a sweep: its plan, written once, and who works in it.
#pragma once

#include "engine/experiments/sweep/sweep_plan.hpp"

#include <filesystem>

namespace trocar::engine {

/// What a folder is to a plan.
enum class FolderState : std::uint8_t { New, Same }; // nothing there yet, or this very plan

/// fails  CannotWrite: other files, a file in the way; BadValue: another plan, with what differs
[[nodiscard]] Result<FolderState> inspect_folder(const std::filesystem::path& folder, const SweepPlan& plan);

/// Held by one program that starts workers; it goes with the process, also with a SIGKILL.
class FolderLock {
public:
    /// fails  CannotWrite: the folder cannot be made or written; another program holds it
    [[nodiscard]] static Result<FolderLock> take(const std::filesystem::path& folder);
    FolderLock(FolderLock&& other) noexcept : lock_(std::exchange(other.lock_, -1)) {}
    FolderLock& operator=(FolderLock&&) = delete;
    ~FolderLock();

private:
    explicit FolderLock(int lock) : lock_(lock) {}
    int lock_ = -1;
};

/// fails  CannotWrite
[[nodiscard]] Result<void> write_plan_once(const std::filesystem::path& folder, const SweepPlan& plan);

} // namespace trocar::engine
