// Comma-separated values with quotes (RFC 4180), in and out.
#pragma once

#include "base/result.hpp"

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace trocar::engine {

struct CsvPlace {
    std::size_t line = 0, column = 0; // 1-based; columns count characters, not bytes
};

struct CsvRow {
    std::size_t line = 0; // where it begins
    std::vector<std::string> cells;
    std::vector<CsvPlace> places; // [cell] of its first character
};

/// Empty lines are left out. A quote that is never closed ends with the text.
[[nodiscard]] std::vector<CsvRow> read_csv(std::string_view text);

/// Of a file, which may have been cut off.
/// fails  BadSyntax: a quote that is never closed, with the place where it opens
[[nodiscard]] Result<std::vector<CsvRow>> read_csv(std::string_view text, const std::filesystem::path& file);

/// The cell in quotes where its content needs them.
[[nodiscard]] std::string csv_cell(std::string_view text);

} // namespace trocar::engine
