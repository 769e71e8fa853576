// How a column of steps.csv becomes one number.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace trocar::engine {

[[nodiscard]] std::vector<std::string_view> reduction_names();

/// Nothing where there are no values, or the name is unknown. A NaN among the values gives NaN.
[[nodiscard]] std::optional<double> reduce(std::string_view take, std::vector<double> values);

/// The values of one column of a table with a header; nothing where it has no such column or a cell is no number.
[[nodiscard]] std::optional<std::vector<double>> column_values(std::string_view csv, std::string_view column);

} // namespace trocar::engine
