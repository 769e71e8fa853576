#include "engine/observe/output_folder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <regex>
#include <string>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

namespace seldinger::engine {

namespace fs = std::filesystem;

namespace {

Error cannot_write(const fs::path& path, std::string message) {
    return {.code = ErrorCode::CannotWrite, .message = std::move(message), .file = path.string()};
}

Error no_folder(const fs::path& path, int reason) {
    return cannot_write(path, fmt::format("the output folder cannot be made: {}", std::strerror(reason)));
}

/// The lock file's name may have moved on to another file between our open and our lock: its holder removed it.
bool is_still_named(int fd, const fs::path& path) {
    struct stat ours {}, named {};
    return ::fstat(fd, &ours) == 0 && ::stat(path.c_str(), &named) == 0 && ours.st_ino == named.st_ino &&
           ours.st_dev == named.st_dev;
}

/// A descriptor that holds the folder. Locks of dead processes are gone with them.
Result<int> lock_folder(const fs::path& folder) {
    const fs::path path = folder / output_name::kLock;
    for (;;) {
        const int fd = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0644);
        if (fd < 0) return cannot_write(folder, fmt::format("the output folder cannot be written: {}", std::strerror(errno)));
        if (::flock(fd, LOCK_EX | LOCK_NB) != 0) {
            const int reason = errno;
            ::close(fd);
            if (reason == EINTR) continue;
            if (reason != EWOULDBLOCK)
                return cannot_write(folder, fmt::format("the output folder cannot be locked: {}", std::strerror(reason)));
            return cannot_write(folder, "another run is writing into this folder; wait for its end or name another with --out "
                                        "(--force does not help here)");
        }
        if (is_still_named(fd, path)) return fd;
        ::close(fd);
    }
}

bool is_temporary_of_ours(const std::string& name) {
    static const std::regex kTemporary(R"(\.(steps\.csv|summary\.json|report\.html|.*\.(vtp|vtu|pvd|png))\.\d+\.\d+\.part)");
    return std::regex_match(name, kTemporary);
}

bool is_output_file(const std::string& name) {
    static const std::array<std::string, 4> kNames{output_name::kSteps, output_name::kPartialSteps, output_name::kSummary,
                                                   output_name::kReport};
    static const std::regex kPicture(R"((anatomy|tip|fluoro)_\d+_t\d+\.\d+s\.png)");
    return std::find(kNames.begin(), kNames.end(), name) != kNames.end() || std::regex_match(name, kPicture) ||
           is_temporary_of_ours(name);
}

bool is_state_file(const std::string& name) {
    static const std::regex kState(R"([^.].*\.(vtp|vtu|pvd))");
    return std::regex_match(name, kState) || is_temporary_of_ours(name);
}

/// Removes the files of a folder that `is_ours` knows; links are removed, never followed.
Result<void> remove_files(const fs::path& folder, bool (*is_ours)(const std::string&)) {
    std::error_code failed;
    std::vector<fs::path> found;
    for (fs::directory_iterator it(folder, failed), end; !failed && it != end; it.increment(failed))
        if (!fs::is_directory(it->symlink_status()) && is_ours(it->path().filename().string())) found.push_back(it->path());
    for (const fs::path& path : found)
        if (!fs::remove(path, failed) && failed) return cannot_write(path, "cannot be removed: " + failed.message());
    return {};
}

Result<void> remove_old_outputs(const fs::path& folder) {
    if (Result<void> removed = remove_files(folder, is_output_file); !removed) return removed;
    for (const char* name : {output_name::kRecord, output_name::kLastGoodState}) {
        const fs::path states = folder / name;
        if (!fs::is_directory(fs::symlink_status(states))) continue;
        if (Result<void> removed = remove_files(states, is_state_file); !removed) return removed;
        std::error_code not_empty;
        fs::remove(states, not_empty); // somebody's files in it keep it
    }
    return {};
}

/// Some file that is in the folder besides the lock; empty where there is none.
std::string any_content(const fs::path& folder) {
    std::error_code failed;
    std::vector<std::string> names;
    for (fs::directory_iterator it(folder, failed), end; !failed && it != end; it.increment(failed))
        if (it->path().filename() != output_name::kLock) names.push_back(it->path().filename().string());
    return names.empty() ? std::string() : *std::min_element(names.begin(), names.end());
}

} // namespace

Result<OutputFolder> OutputFolder::open(const fs::path& path, bool force) {
    if (path.empty()) return cannot_write(path, "the output folder has no name");
    std::error_code failed;
    const fs::file_status status = fs::status(path, failed);
    if (fs::exists(status) && !fs::is_directory(status)) return cannot_write(path, "is a file; --out wants a folder");
    fs::create_directories(path, failed);
    if (failed) return no_folder(path, failed.value());
    Result<int> lock = lock_folder(path);
    if (!lock) return lock.error();
    OutputFolder folder(path, *lock);
    const std::string content = any_content(path);
    if (content.empty()) return folder;
    if (!force)
        return cannot_write(path, fmt::format("the output folder is not empty (it holds {}); --force writes into it and replaces "
                                              "the outputs of an earlier run", content));
    if (Result<void> removed = remove_old_outputs(path); !removed) return removed.error();
    return folder;
}

OutputFolder::OutputFolder(OutputFolder&& other) noexcept
    : path_(std::move(other.path_)), lock_(std::exchange(other.lock_, -1)) {}

OutputFolder::~OutputFolder() {
    if (lock_ < 0) return;
    std::error_code ignored;
    fs::remove(path_ / output_name::kLock, ignored); // while it is held: the next one makes its own
    ::close(lock_);
}

} // namespace seldinger::engine
