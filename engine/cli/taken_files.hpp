// Files that a command line names twice: what is written must not be what is read, nor what another option writes.
#pragma once

#include "base/result.hpp"

#include <filesystem>
#include <span>
#include <string>

namespace trocar::engine {

/// Do both names stand for one place, whether or not something is there?
[[nodiscard]] bool is_same_place(const std::filesystem::path& one, const std::filesystem::path& other);

/// fails  BadUsage under the option's name: the file is one of those, by whatever way it is named
[[nodiscard]] Result<void> check_not_taken(const std::filesystem::path& file, std::span<const std::filesystem::path> taken,
                                           std::string option);

} // namespace trocar::engine
