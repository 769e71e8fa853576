// Paths of instruments as CSV: rows "t,insertion,rotation", in whatever units the scene declares; or of several instruments in one
// file, "t,NAME.insertion,NAME.rotation,OTHER.insertion,OTHER.rotation".
#pragma once

#include "base/result.hpp"

#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace trocar::engine {

/// One row, numbers as in the file: the caller converts units.
struct PathRow {
    double time = 0, insertion = 0, rotation = 0;
    std::size_t line = 0;                // of the file, from 1; 0: of none
    std::array<std::size_t, 3> column{}; // where the three numbers begin, from 1
};

/// What one file says of one instrument.
struct NamedPath {
    std::string instrument; // empty: the file names none
    std::vector<PathRow> rows;
    std::size_t line = 0, column = 0; // of the name; 0 without
};

/// Reads a path: three finite numbers a row, time strictly increasing, at least one row. A header line is optional
/// (its columns must be t or time, insertion, rotation, each with a unit suffix or without, and tell their order); blank lines and
/// what follows a # are passed over.
/// fails     with file, line and column
[[nodiscard]] Result<std::vector<PathRow>> read_path_csv(const std::filesystem::path& path);

/// The same on a text in memory; file_name is only for messages.
[[nodiscard]] Result<std::vector<PathRow>> parse_path_csv(std::string_view text, std::string_view file_name);

/// The same, or of several instruments: then a header names them, NAME.insertion and NAME.rotation for each, in any order beside
/// the time. Every row has all columns.
/// returns   one path without a name, or those of the header in its order
[[nodiscard]] Result<std::vector<NamedPath>> read_path_table(const std::filesystem::path& path);
[[nodiscard]] Result<std::vector<NamedPath>> parse_path_table(std::string_view text, std::string_view file_name);

/// "t,insertion,rotation" and one row a line, numbers with all their digits.
[[nodiscard]] Result<void> write_path_csv(const std::filesystem::path& path, const std::vector<PathRow>& rows);

} // namespace trocar::engine
