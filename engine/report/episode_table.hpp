// actions.csv: a row for each action of an episode. The columns stand here because sweeps check names against them.
#pragma once

#include "engine/report/output_keys.hpp"

#include <string>
#include <vector>

namespace trocar::engine {

/// Name, unit and meaning of every column, in their order.
[[nodiscard]] std::vector<OutputKey> action_table_columns();

/// "action,time_s,..." without a line end.
[[nodiscard]] std::string action_table_header();

} // namespace trocar::engine
