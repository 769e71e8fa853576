// Files that end complete or are not there: written beside their place, then renamed.
#pragma once

#include "base/result.hpp"

#include <filesystem>
#include <string>
#include <string_view>

namespace trocar::engine {

/// Writes bytes to path through a temporary file in the same folder, flushed to the disk and renamed over what was
/// there. Readers see the old file or the new one, never a part. Symbolic links are followed; a device or a pipe is
/// written directly. The folder must exist.
/// fails     CannotWrite with the system's reason (disk full, read-only, no such folder); nothing is left behind
[[nodiscard]] Result<void> write_file_atomically(const std::filesystem::path& path, std::string_view bytes);

/// Before long work whose result is to be written there: is it a folder, or in none? Says which option named it.
[[nodiscard]] Result<void> check_place(const std::filesystem::path& file, std::string option);

} // namespace trocar::engine
