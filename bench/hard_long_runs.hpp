// Ten minutes of simulated time: does anything drift?
#pragma once

#include "bench/bench_table.hpp"

namespace trocar::engine {

/// Rows and plots of the main scene (or --scene) and of a heap of 16 bodies: energy, memory and step time, second by second.
/// Takes as long as that takes: half an hour of one core, about.
[[nodiscard]] Result<void> add_long_runs(const BenchOptions& options, BenchTable& table);

} // namespace trocar::engine
