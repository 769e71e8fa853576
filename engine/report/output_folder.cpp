#include "engine/report/output_folder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

namespace trocar::engine {

namespace fs = std::filesystem;

namespace {

Error cannot_write(const fs::path& path, std::string message) {
    return {.code = ErrorCode::CannotWrite, .message = std::move(message), .file = path.string()};
}

Error no_folder(const fs::path& path, int reason) {
    return cannot_write(path, fmt::format("the output folder cannot be made: {}", std::strerror(reason)));
}

Error in_use(const fs::path& folder) {
    return cannot_write(folder, "another run is writing into this folder; wait for its end or name another with --out "
                                "(--force does not help here)");
}

Error occupied(const fs::path& folder, const std::string& content) {
    return cannot_write(folder, fmt::format("the output folder is not empty (it holds {}); --force writes into it and replaces "
                                            "the outputs of an earlier run",
                                            content));
}

/// A folder, or nothing yet.
Result<void> check_kind(const fs::path& path) {
    if (path.empty()) return cannot_write(path, "the output folder has no name");
    std::error_code failed;
    const fs::file_status status = fs::status(path, failed);
    if (fs::exists(status) && !fs::is_directory(status)) return cannot_write(path, "is a file; --out wants a folder");
    return {};
}

/// The nearest folder above that is there takes new ones.
Result<void> check_can_be_made(const fs::path& path) {
    std::error_code failed;
    fs::path above = fs::absolute(path, failed).lexically_normal();
    while (above.has_relative_path() && !fs::exists(fs::symlink_status(above, failed))) above = above.parent_path();
    if (!fs::is_directory(above, failed)) return no_folder(path, ENOTDIR);
    if (::access(above.c_str(), W_OK | X_OK) != 0) return no_folder(path, errno);
    return {};
}

/// The lock file's name may name another file between our open and our lock: its holder removed it.
bool is_still_named(int fd, const fs::path& path) {
    struct stat ours {
    }, named{};
    return ::fstat(fd, &ours) == 0 && ::stat(path.c_str(), &named) == 0 && ours.st_ino == named.st_ino && ours.st_dev == named.st_dev;
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
            return in_use(folder);
        }
        if (is_still_named(fd, path)) return fd;
        ::close(fd);
    }
}

/// Takes a run of digits off the front; false where there is none.
bool skip_digits(std::string_view& text) {
    const std::size_t count = std::min(text.find_first_not_of("0123456789"), text.size());
    text.remove_prefix(count);
    return count > 0;
}

bool skip(std::string_view& text, std::string_view piece) {
    if (!text.starts_with(piece)) return false;
    text.remove_prefix(piece.size());
    return true;
}

bool has_state_ending(std::string_view name) { return name.ends_with(".vtp") || name.ends_with(".vtu") || name.ends_with(".pvd"); }

/// anatomy_01_t04.20s.png
bool is_picture(std::string_view name) {
    return (skip(name, "anatomy_") || skip(name, "tip_") || skip(name, "fluoro_")) && skip_digits(name) && skip(name, "_t") &&
           skip_digits(name) && skip(name, ".") && skip_digits(name) && name == "s.png";
}

bool is_page(std::string_view name) {
    return name == output_name::kSteps || name == output_name::kActions || name == output_name::kPartialSteps || name == output_name::kSummary ||
           name == output_name::kReport || name == output_name::kTrace || name == output_name::kCost || name == output_name::kCostJson ||
           name == output_name::kPath || name == output_name::kCentreline || name == output_name::kPlan || name == output_name::kPrepare ||
           name == output_name::kSpheres || name == output_name::kCheckpoint || name == output_name::kManifest ||
           name == output_name::kManifestHash;
}

/// .NAME.PID.COUNT.part, which a run that was killed while it wrote leaves behind
bool is_temporary(std::string_view name, bool (*is_ours)(std::string_view)) {
    if (!skip(name, ".") || !name.ends_with(".part")) return false;
    name.remove_suffix(5);
    for (int number = 0; number < 2; ++number) {
        const std::size_t dot = name.rfind('.');
        if (dot == std::string_view::npos) return false;
        std::string_view digits = name.substr(dot + 1);
        if (!skip_digits(digits) || !digits.empty()) return false;
        name = name.substr(0, dot);
    }
    return is_ours(name);
}

bool is_output_file(std::string_view name) {
    const auto is_ours = [](std::string_view n) { return is_page(n) || is_picture(n); };
    return is_ours(name) || is_temporary(name, is_ours);
}

bool is_state_file(std::string_view name) {
    const auto is_ours = [](std::string_view n) { return !n.starts_with(".") && has_state_ending(n); };
    return is_ours(name) || is_temporary(name, is_ours);
}

/// NAME_000010.png, NAME_000010_device.png, NAME.dcm and the tables
bool is_xray_file(std::string_view name) {
    const auto is_ours = [](std::string_view n) {
        if (n == "frames.csv" || n == "centrelines.csv" || n == "contrast.csv") return true;
        if (n.starts_with(".")) return false;
        if (n.ends_with(".dcm") || n.ends_with("_film.png")) return true;
        for (const std::string_view ending : {"_device.png", "_vessel.png", "_depth.png", ".png"})
            if (n.ends_with(ending)) {
                const std::string_view stem = n.substr(0, n.size() - ending.size());
                std::string_view digits = stem.substr(std::min(stem.rfind('_'), stem.size() - 1) + 1);
                return stem.rfind('_') != std::string_view::npos && digits.size() >= 6 && skip_digits(digits) && digits.empty();
            }
        return false;
    };
    return is_ours(name) || is_temporary(name, is_ours);
}

/// Removes the files of a folder that `is_ours` knows, but for the one named `keep`; links are removed, never followed.
Result<void> remove_files(const fs::path& folder, bool (*is_ours)(std::string_view), std::string_view keep) {
    std::error_code failed;
    std::vector<fs::path> found;
    for (fs::directory_iterator it(folder, failed), end; !failed && it != end; it.increment(failed))
        if (const std::string name = it->path().filename().string();
            !fs::is_directory(it->symlink_status()) && is_ours(name) && name != keep)
            found.push_back(it->path());
    for (const fs::path& path : found)
        if (!fs::remove(path, failed) && failed) return cannot_write(path, "cannot be removed: " + failed.message());
    return {};
}

Result<void> remove_old_outputs(const fs::path& folder, std::string_view keep) {
    if (Result<void> removed = remove_files(folder, is_output_file, keep); !removed) return removed;
    for (const char* name : {output_name::kRecord, output_name::kLastGoodState, output_name::kFluoro}) {
        const fs::path states = folder / name;
        if (!fs::is_directory(fs::symlink_status(states))) continue;
        const auto is_ours = name == output_name::kFluoro ? is_xray_file : is_state_file;
        if (Result<void> removed = remove_files(states, is_ours, {}); !removed) return removed;
        std::error_code not_empty;
        fs::remove(states, not_empty); // other files in it keep it
    }
    return {};
}

/// Is this a file of the folder that remove_old_outputs(folder, keep) would remove?
bool is_old_output(const fs::path& folder, const fs::path& file, std::string_view keep) {
    std::error_code unknown;
    const fs::path place = file.has_parent_path() ? file.parent_path() : fs::path(".");
    const std::string name = file.filename().string();
    if (fs::equivalent(place, folder, unknown)) return is_output_file(name) && name != keep;
    if (fs::equivalent(place, folder / output_name::kFluoro, unknown)) return is_xray_file(name);
    for (const char* states : {output_name::kRecord, output_name::kLastGoodState})
        if (fs::equivalent(place, folder / states, unknown)) return is_state_file(name);
    return false;
}

/// By its own name, and by that of the file that it links to.
Result<void> check_reads(const fs::path& folder, std::span<const fs::path> reads, std::string_view keep) {
    for (const fs::path& file : reads) {
        std::error_code not_there;
        const fs::path target = fs::canonical(file, not_there);
        if (not_there || !(is_old_output(folder, file, keep) || is_old_output(folder, target, keep))) continue;
        return Error{ErrorCode::BadUsage,
                     fmt::format("is read, and lies in {} under the name of an output, which is replaced; expected another output folder",
                                 folder.string()),
                     file.string(), 0, 0, "--out"};
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

Result<void> OutputFolder::check(const fs::path& path, bool force, std::span<const fs::path> reads, const char* keep) {
    if (Result<void> fits = check_kind(path); !fits) return fits;
    if (Result<void> apart = check_reads(path, reads, keep != nullptr ? keep : ""); !apart) return apart;
    std::error_code failed;
    if (!fs::exists(path, failed)) return check_can_be_made(path);
    if (::access(path.c_str(), W_OK | X_OK) != 0)
        return cannot_write(path, fmt::format("the output folder cannot be written: {}", std::strerror(errno)));
    if (const int fd = ::open((path / output_name::kLock).c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW); fd >= 0) {
        const bool held = ::flock(fd, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK;
        ::close(fd); // and with it the lock
        if (held) return in_use(path);
    }
    if (const std::string content = any_content(path); !content.empty() && !force) return occupied(path, content);
    return {};
}

Result<OutputFolder> OutputFolder::open(const fs::path& path, bool force, const char* keep) {
    if (Result<void> fits = check_kind(path); !fits) return fits.error();
    std::error_code failed;
    fs::create_directories(path, failed);
    if (failed) return no_folder(path, failed.value());
    Result<int> lock = lock_folder(path);
    if (!lock) return lock.error();
    OutputFolder folder(path, *lock);
    const std::string content = any_content(path);
    if (content.empty()) return folder;
    if (!force) return occupied(path, content);
    if (Result<void> removed = remove_old_outputs(path, keep != nullptr ? keep : ""); !removed) return removed.error();
    return folder;
}

OutputFolder::OutputFolder(OutputFolder&& other) noexcept : path_(std::move(other.path_)), lock_(std::exchange(other.lock_, -1)) {}

OutputFolder::~OutputFolder() {
    if (lock_ < 0) return;
    std::error_code ignored;
    fs::remove(path_ / output_name::kLock, ignored); // while it is held: the next one makes its own
    ::close(lock_);
}

} // namespace trocar::engine
