// A sweep's options of its command, checked before anything runs.
#pragma once

#include "engine/experiments/sweep/sweep_plan.hpp"

namespace trocar::engine {

/// Does the command take them, and every value of a varied one; can every policy of an episode be loaded?
/// fails  BadUsage and what check_policy says, at the place in the sweep
[[nodiscard]] Result<void> check_sweep_options(const SweepSpec& spec, const SweepPlan& plan);

} // namespace trocar::engine
