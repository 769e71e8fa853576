#include "engine/cli/sweep_folder.hpp"

#include "engine/experiments/sweep/result_store.hpp"
#include "engine/io/atomic_file.hpp"
#include "engine/io/file_bytes.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

namespace trocar::engine {
namespace {

namespace fs = std::filesystem;

Error cannot_write(const fs::path& folder, std::string message) { return {ErrorCode::CannotWrite, std::move(message), folder.string()}; }

/// The first thing in which two plans differ.
std::string tell_difference(const SweepPlan& there, const SweepPlan& plan) {
    if (there.program != plan.program) return fmt::format("it was made by {}, and this is {}", there.program, plan.program);
    if (there.folder != plan.folder) return fmt::format("its sweep lies in {}", there.folder);
    for (std::size_t i = 0; i < std::min(there.scenes.size(), plan.scenes.size()); ++i) {
        if (there.scenes[i].file != plan.scenes[i].file) return fmt::format("it is of the scene {}", there.scenes[i].file);
        if (there.scenes[i].hash != plan.scenes[i].hash) return fmt::format("the scene {} has changed since", plan.scenes[i].file);
    }
    for (const PlannedFile& one : there.files)
        for (const PlannedFile& other : plan.files)
            if (one.file == other.file && one.hash != other.hash) return fmt::format("the file {} has changed since", one.file);
    if (there.run_count() != plan.run_count()) return fmt::format("it has {} runs, and this one {}", there.run_count(), plan.run_count());
    return "the sweep's file has changed since";
}

} // namespace

Result<FolderState> inspect_folder(const fs::path& folder, const SweepPlan& plan) {
    std::error_code failed;
    if (!fs::exists(folder, failed)) return FolderState::New;
    if (!fs::is_directory(folder, failed)) return cannot_write(folder, "is a file; --out wants a folder");
    const fs::path file = folder / sweep_name::kPlan;
    if (!fs::exists(file, failed)) {
        for (fs::directory_iterator it(folder, failed), end; !failed && it != end; it.increment(failed)) {
            const std::string name = it->path().filename().string();
            if (name != sweep_name::kLock && !name.starts_with(fmt::format(".{}.", sweep_name::kPlan)))
                return cannot_write(folder, fmt::format("holds no sweep and is not empty (it holds {}); expected a folder of its own", name));
        }
        return FolderState::New;
    }
    const auto there = read_plan(file);
    if (!there) return there.error();
    const auto text = read_file_bytes(file);
    if (!text) return text.error();
    if (*text == plan.text()) return FolderState::Same;
    return Error{ErrorCode::BadValue, fmt::format("holds the results of another plan: {}; expected another --out", tell_difference(*there, plan)),
                 folder.string()};
}

Result<FolderLock> FolderLock::take(const fs::path& folder) {
    std::error_code failed;
    fs::create_directories(folder, failed);
    if (failed) return cannot_write(folder, "the folder cannot be made: " + failed.message());
    const int lock = ::open((folder / sweep_name::kLock).c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0666);
    if (lock < 0) return cannot_write(folder, fmt::format("the folder cannot be written: {}", std::strerror(errno)));
    if (::flock(lock, LOCK_EX | LOCK_NB) == 0) return FolderLock(lock);
    const int reason = errno;
    ::close(lock);
    if (reason == EWOULDBLOCK)
        return cannot_write(folder, "another program runs this sweep; --status tells how far it is");
    return cannot_write(folder, fmt::format("the folder cannot be locked: {}", std::strerror(reason)));
}

FolderLock::~FolderLock() {
    if (lock_ >= 0) ::close(lock_);
}

Result<void> write_plan_once(const fs::path& folder, const SweepPlan& plan) { return write_file_atomically(folder / sweep_name::kPlan, plan.text()); }

} // namespace trocar::engine
