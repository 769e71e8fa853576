// The list of benches: a new table is a function in its own file and a line here.
#pragma once

#include "engine/bench/bench.hpp"

#include <array>

namespace seldinger::engine {

[[nodiscard]] Result<BenchTable> bench_deadline(const BenchOptions& options);

inline constexpr std::array kBenches{
    Bench{"deadline", "budgets from 0.1 to 33 ms on the main scene: kept or not, p99, p99.9, worst", bench_deadline},
};

} // namespace seldinger::engine
