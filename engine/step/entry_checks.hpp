// What a caller of the simulator may hand in, checked before anything is touched: an Error says what was found and what is expected.
// A model is taken as prepare_scene made it; of the settings that a caller may change in it, every number is looked at.
#pragma once

#include "base/result.hpp"
#include "engine/state/inputs.hpp"
#include "engine/state/state.hpp"

namespace trocar::engine {

/// fails  BadValue: a mode that there is not; of mode Wall a time that is not finite, negative, or above kMaxBudgetSeconds
[[nodiscard]] Result<void> check_limits(const BudgetLimits& limits);

/// fails  BadValue: no such instrument, an insertion or a rotation that is not finite
[[nodiscard]] Result<void> check_drive_command(const SceneModel& model, std::size_t instrument, const DriveCommand& wanted);

/// fails  BadValue: no such body or vertex, a target that is not finite or farther than kMaxCoordinate from the origin
[[nodiscard]] Result<void> check_pull(const SceneModel& model, const Pull& pull);

/// fails  BadValue: as Simulator::check_inputs
[[nodiscard]] Result<void> check_inputs(const SceneModel& model, const Inputs& inputs);

/// fails  BadValue: step, sub-steps, gravity, breathing, pulse, blood or contact settings that no step can be taken with
[[nodiscard]] Result<void> check_settings(const SceneModel& model);

} // namespace trocar::engine
