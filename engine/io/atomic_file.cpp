#include "engine/io/atomic_file.hpp"

#include <fmt/format.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <string>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace trocar::engine {
namespace {

Error cannot_write(const std::filesystem::path& path, int reason) {
    return {ErrorCode::CannotWrite, fmt::format("cannot be written: {}", std::strerror(reason)), path.string()};
}

/// 0, or the system's reason.
int write_all(int fd, std::string_view bytes) {
    while (!bytes.empty()) {
        const ssize_t written = ::write(fd, bytes.data(), bytes.size());
        if (written < 0 && errno == EINTR) continue;
        if (written < 0) return errno;
        bytes.remove_prefix(static_cast<std::size_t>(written));
    }
    return 0;
}

/// Writes, optionally flushes to the disk, and closes. 0, or the system's reason: a full disk may only show at the end.
int write_and_close(int fd, std::string_view bytes, bool flush) {
    int reason = write_all(fd, bytes);
    if (reason == 0 && flush && ::fsync(fd) != 0 && errno != EINVAL) reason = errno;
    if (::close(fd) != 0 && reason == 0) reason = errno;
    return reason;
}

Result<void> write_directly(const std::filesystem::path& path, std::string_view bytes) {
    const int fd = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
    if (fd < 0) return cannot_write(path, errno);
    const int reason = write_and_close(fd, bytes, false);
    if (reason != 0) return cannot_write(path, reason);
    return {};
}

/// Two writers of the same file, in one process or in two, must not share the temporary one.
std::filesystem::path temporary_beside(const std::filesystem::path& target) {
    static std::atomic<unsigned> counter{0};
    return target.parent_path() / fmt::format(".{}.{}.{}.part", target.filename().string().substr(0, 200), ::getpid(), counter++);
}

} // namespace

Result<void> write_file_atomically(const std::filesystem::path& path, std::string_view bytes) {
    std::filesystem::path target = path;
    std::error_code failed;
    if (std::filesystem::is_symlink(path, failed)) {
        target = std::filesystem::canonical(path, failed);
        if (failed) return cannot_write(path, failed.value());
    }
    struct stat old {};
    const bool exists = ::stat(target.c_str(), &old) == 0;
    if (exists && S_ISDIR(old.st_mode)) return cannot_write(path, EISDIR);
    if (exists && !S_ISREG(old.st_mode)) return write_directly(target, bytes);

    const std::filesystem::path temporary = temporary_beside(target);
    const int fd = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (fd < 0) return cannot_write(path, errno);
    if (exists) (void)::fchmod(fd, old.st_mode & 0777); // a new file must not open up an old one; failing is harmless
    int reason = write_and_close(fd, bytes, true);
    if (reason == 0 && ::rename(temporary.c_str(), target.c_str()) != 0) reason = errno;
    if (reason == 0) return {};
    (void)::unlink(temporary.c_str());
    return cannot_write(path, reason);
}

Result<void> check_place(const std::filesystem::path& file, std::string option) {
    std::error_code failed;
    const std::filesystem::path folder = file.has_parent_path() ? file.parent_path() : ".";
    if (std::filesystem::is_directory(file, failed))
        return Error{ErrorCode::CannotWrite, "is a folder; expected the name of a file", file.string(), 0, 0, std::move(option)};
    if (!std::filesystem::is_directory(folder, failed))
        return Error{ErrorCode::CannotWrite, "its folder does not exist", file.string(), 0, 0, std::move(option)};
    return {};
}

} // namespace trocar::engine
