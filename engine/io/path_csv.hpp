// Catheter paths as CSV: rows "t,insertion,rotation", in whatever units the scene declares.
#pragma once

#include "base/result.hpp"

#include <filesystem>
#include <string_view>
#include <vector>

namespace seldinger::engine {

/// One row, numbers as in the file: the caller converts units.
struct PathRow {
    double time = 0, insertion = 0, rotation = 0;
};

/// Reads a path: three finite numbers a row, time strictly increasing, at least one row. A header line is optional
/// (its columns must be t or time, insertion, rotation, each with a unit suffix or without); blank lines and what
/// follows a # are passed over.
/// fails     with file, line and column
[[nodiscard]] Result<std::vector<PathRow>> read_path_csv(const std::filesystem::path& path);

/// The same on a text in memory; file_name is only for messages.
[[nodiscard]] Result<std::vector<PathRow>> parse_path_csv(std::string_view text, std::string_view file_name);

/// "t,insertion,rotation" and one row a line, numbers with all their digits.
[[nodiscard]] Result<void> write_path_csv(const std::filesystem::path& path, const std::vector<PathRow>& rows);

} // namespace seldinger::engine
