// The tables of what a run writes, all of them.
#pragma once

#include "engine/report/output_keys.hpp"

#include <vector>

namespace trocar::engine {

/// Files of an output folder, steps.csv, summary.json.
[[nodiscard]] std::vector<OutputTable> run_output_tables();

} // namespace trocar::engine
