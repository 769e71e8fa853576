// What a run came to, in numbers.
#pragma once

#include "engine/time/pacer.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace trocar::engine {

/// Percentiles of one series, ms.
struct Percentiles {
    double p50 = 0.0, p95 = 0.0, p99 = 0.0, max = 0.0;
};

/// summary.json as numbers: what the last line on the terminal and the report's first lines are made of.
struct RunSummary {
    std::uint64_t steps = 0;
    double simulated_s = 0.0, wall_s = 0.0, realtime_factor = 0.0;
    std::optional<PaceSpec> pace; // none: as fast as it went
    PaceStats pace_stats;
    Percentiles step_ms, collision_ms, charged_ms;
    double budget_kept = 1.0;   // share of steps whose budgeted part ended within the budget, 0..1
    double realtime_kept = 1.0; // share of whole steps that took no longer than they simulate, 0..1
    double worst_overrun_ms = 0.0;
    std::uint64_t overruns = 0, realtime_overruns = 0; // steps that did not, of either kind
    std::uint64_t lumen_exits = 0, unresolved = 0, assumed = 0, contacts = 0, exact_steps = 0, scaled_steps = 0;
    std::uint64_t unproven_steps = 0; // in which nothing proved an instrument free of its wall
    std::uint64_t passed_places = 0, unproven_solids = 0; // sums of the steps'
    std::uint64_t floor_steps = 0; // that overran their budget by what nothing leaves out
    double floor_ms = -1.0;        // what the budget's scope takes of a step under a budget of nothing; negative: not measured (no budget of time)
    double target_distance_m = -1.0;
    std::string state_hash; // hex
    bool finite = true;
    std::string failure;
    std::vector<std::string> missing_outputs; // a sentence for each that could not be written; empty: all are there
};

} // namespace trocar::engine
