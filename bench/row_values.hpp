// Values of a row, or of anything that stands in a bench's JSON, whatever a file may hold in their place.
#pragma once

#include "bench/bench_table.hpp"

#include <optional>
#include <string>

namespace trocar::engine {

/// Null where the row is no object or has no such key.
[[nodiscard]] inline const BenchRow& row_value(const BenchRow& row, const char* key) {
    static const BenchRow kNull;
    const auto found = row.find(key);
    return found != row.end() ? *found : kNull;
}

/// Empty where it is not there, or no text.
[[nodiscard]] inline std::string row_text(const BenchRow& row, const char* key) {
    const BenchRow& value = row_value(row, key);
    return value.is_string() ? value.get<std::string>() : std::string();
}

/// Nothing where it is not there, or no number.
[[nodiscard]] inline std::optional<double> row_number(const BenchRow& row, const char* key) {
    const BenchRow& value = row_value(row, key);
    return value.is_number() ? std::optional(value.get<double>()) : std::nullopt;
}

} // namespace trocar::engine
