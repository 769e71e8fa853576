// How far runs have gone from their references: a page with a table and a curve per scene.
#pragma once

#include "engine/experiments/regression.hpp"

#include <span>

namespace trocar::engine {

/// One part of a scene against its reference, over the samples of a run.
struct PartDrift {
    std::string part;
    std::uint64_t first_step = 0;                        // in which some point was beyond the tolerance; 0: in none
    std::uint64_t worst_step = 0;                        // in which some point was farthest away
    Index worst_node = kNoIndex;                         // which
    double worst_m = 0.0;                                // how far; infinite where it is not finite
    std::vector<std::pair<std::uint64_t, double>> curve; // step, m: farthest point of each sample
};

/// By part, in the trace's order. Samples and parts that are not the same mesh in both are left out.
[[nodiscard]] std::vector<PartDrift> measure_drift(const Trace& reference, const Trace& now, double tolerance);

struct RegressionOutcome {
    RegressionEntry entry;
    Trace reference, now;
    std::string difference; // the first, in words; empty: none
};

/// One page without any other file; curves of the scenes that differ. Without gnuplot a sentence stands in their place.
[[nodiscard]] std::string regression_page(std::span<const RegressionOutcome> outcomes);

} // namespace trocar::engine
