// The floor: what a step is charged under a budget of nothing. Measured, beside the scene's own steps.
#pragma once

#include "engine/state/state.hpp"
#include "engine/step/simulator.hpp"

#include <optional>

namespace trocar::engine {

struct Floor {
    double ms = 0.0;                               // median over the steps of what the budget's scope was charged
    std::array<double, kAccountParts> part_ms{};   // by AccountPart, medians: they sum to about ms
    std::uint64_t steps = 0;                       // that were measured
};

/// Steps under work:0 from such a state (none: the scene's start), in a simulator of its own made like that one: nothing that the caller has changes.
/// returns  nothing where no step could be taken
/// cost     at most `steps`, and not many more milliseconds than most_ms
[[nodiscard]] std::optional<Floor> measure_floor(const Simulator& like, const State* from, std::uint64_t steps = 20, double most_ms = 200.0);

} // namespace trocar::engine
