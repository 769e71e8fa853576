#include "engine/io/atomic_file.hpp"

#include <fmt/format.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <string>
#include <vector>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace trocar::engine {
namespace {

constexpr std::size_t kAtOnce = std::size_t{1} << 16; // bytes that are written at once

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

/// Two writers of the same file, in one process or in two, must not share the temporary one.
std::filesystem::path temporary_beside(const std::filesystem::path& target) {
    static std::atomic<unsigned> counter{0};
    return target.parent_path() / fmt::format(".{}.{}.{}.part", target.filename().string().substr(0, 200), ::getpid(), counter++);
}

bool is_temporary(const std::string& name) { return name.starts_with('.') && name.ends_with(".part"); }

} // namespace

void remove_temporaries(const std::filesystem::path& folder) {
    std::error_code failed;
    std::vector<std::filesystem::path> left;
    for (std::filesystem::directory_iterator it(folder, failed), end; !failed && it != end; it.increment(failed))
        if (is_temporary(it->path().filename().string())) left.push_back(it->path());
    for (const std::filesystem::path& one : left) std::filesystem::remove(one, failed);
}

Result<AtomicFile> AtomicFile::create(const std::filesystem::path& path) {
    std::filesystem::path target = path;
    std::error_code failed;
    if (std::filesystem::is_symlink(path, failed)) {
        target = std::filesystem::canonical(path, failed);
        if (failed) return cannot_write(path, failed.value());
    }
    struct stat old {};
    const bool exists = ::stat(target.c_str(), &old) == 0;
    if (exists && S_ISDIR(old.st_mode)) return cannot_write(path, EISDIR);
    const bool is_device = exists && !S_ISREG(old.st_mode);
    const std::filesystem::path temporary = is_device ? std::filesystem::path() : temporary_beside(target);
    const int file = is_device ? ::open(target.c_str(), O_WRONLY | O_CLOEXEC) : ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (file < 0) return cannot_write(path, errno);
    if (exists && !is_device) (void)::fchmod(file, old.st_mode & 0777); // a new file must not open up an old one; failing is harmless
    return AtomicFile(path, target, temporary, file);
}

AtomicFile::AtomicFile(AtomicFile&& other) noexcept
    : path_(std::move(other.path_)), target_(std::move(other.target_)), temporary_(std::exchange(other.temporary_, {})),
      file_(std::exchange(other.file_, -1)), pending_(std::move(other.pending_)) {}

AtomicFile::~AtomicFile() {
    if (file_ >= 0) ::close(file_);
    if (!temporary_.empty()) (void)::unlink(temporary_.c_str());
}

Result<void> AtomicFile::add(std::string_view bytes) {
    pending_ += bytes;
    if (pending_.size() < kAtOnce) return {};
    const int reason = write_all(file_, pending_);
    pending_.clear();
    return reason == 0 ? Result<void>() : cannot_write(path_, reason);
}

Result<void> AtomicFile::finish() {
    int reason = write_all(file_, pending_); // a full disk may only show at the end
    if (reason == 0 && !temporary_.empty() && ::fsync(file_) != 0 && errno != EINVAL) reason = errno;
    if (::close(std::exchange(file_, -1)) != 0 && reason == 0) reason = errno;
    if (reason == 0 && !temporary_.empty() && ::rename(temporary_.c_str(), target_.c_str()) != 0) reason = errno;
    if (reason != 0) return cannot_write(path_, reason);
    temporary_.clear();
    return {};
}

Result<void> write_file_atomically(const std::filesystem::path& path, std::string_view bytes) {
    auto file = AtomicFile::create(path);
    if (!file) return file.error();
    if (auto added = file->add(bytes); !added) return added;
    return file->finish();
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
