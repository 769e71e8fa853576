// Comma-separated values with quotes (RFC 4180), in and out.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace trocar::engine {

struct CsvRow {
    std::size_t line = 0; // 1-based, where it begins
    std::vector<std::string> cells;
};

/// Empty lines are left out. A quote that is never closed ends with the text.
[[nodiscard]] std::vector<CsvRow> read_csv(std::string_view text);

/// The cell in quotes where its content needs them.
[[nodiscard]] std::string csv_cell(std::string_view text);

} // namespace trocar::engine
