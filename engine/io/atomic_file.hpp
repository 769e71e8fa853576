// Files that end complete or are not there: written beside their place, then renamed.
#pragma once

#include "base/result.hpp"

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>

namespace trocar::engine {

/// Writes bytes to path through a temporary file in the same folder, flushed to the disk and renamed over what was
/// there. Readers see the old file or the new one, never a part. Symbolic links are followed; a device or a pipe is
/// written directly. The folder must exist.
/// fails     CannotWrite with the system's reason (disk full, read-only, no such folder); nothing is left behind
[[nodiscard]] Result<void> write_file_atomically(const std::filesystem::path& path, std::string_view bytes);

/// The same for what is written piece by piece, and never held whole. Without finish() nothing is left behind.
class AtomicFile {
public:
    /// fails  as write_file_atomically
    [[nodiscard]] static Result<AtomicFile> create(const std::filesystem::path& path);
    AtomicFile(AtomicFile&& other) noexcept;
    AtomicFile& operator=(AtomicFile&&) = delete;
    ~AtomicFile();

    [[nodiscard]] Result<void> add(std::string_view bytes);
    /// On the disk and under its name when it returns.
    [[nodiscard]] Result<void> finish();

private:
    AtomicFile(std::filesystem::path path, std::filesystem::path target, std::filesystem::path temporary, int file)
        : path_(std::move(path)), target_(std::move(target)), temporary_(std::move(temporary)), file_(file) {}
    std::filesystem::path path_, target_, temporary_; // temporary empty: a device, written directly
    int file_ = -1;
    std::string pending_;
};

/// Before long work whose result is to be written there: is it a folder, or in none? Says which option named it.
[[nodiscard]] Result<void> check_place(const std::filesystem::path& file, std::string option);

/// What killed writers left in a folder. Nobody may be writing there.
void remove_temporaries(const std::filesystem::path& folder);

} // namespace trocar::engine
