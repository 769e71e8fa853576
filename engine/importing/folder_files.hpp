// Files of one kind in a folder, in the order of their names.
#pragma once

#include "base/result.hpp"

#include <filesystem>
#include <string_view>
#include <vector>

namespace trocar::engine {

/// Files that a folder may hold of one kind.
inline constexpr std::size_t kMostFolderFiles = 10'000;

/// path  a folder, or one such file
/// fails FileNotFound: neither; BadValue: none in it, or more than kMostFolderFiles
[[nodiscard]] Result<std::vector<std::filesystem::path>> list_files(const std::filesystem::path& path, std::string_view ending);

} // namespace trocar::engine
