// A hand that holds a point of a dense surface: one spring on the coarse nodes that carry the point, through the transposed
// links, as contacts reach the tissue.
#pragma once

#include "engine/state/inputs.hpp"
#include "engine/state/state.hpp"
#include "engine/state/step_report.hpp"
#include "engine/step/tissue/tissue_scratch.hpp"

namespace trocar::engine {

/// N/m, of the hand's grip: about what soft tissue answers over a patch of 2 cm, so that it follows about half way.
inline constexpr double kPullStiffness = 150.0;
/// N; a firm grip tears liver at about this. A target further away than this force allows pulls no harder.
inline constexpr double kMaxPull = 3.0;

/// Can this surface be pulled: does tissue carry it?
[[nodiscard]] bool can_be_pulled(const SceneModel& model, std::size_t body) noexcept;

/// Adds it to the springs that this step's integration feels. Its direction is that of the start of the step.
/// Nothing where the point does not move with tissue.
void add_pull(const SceneModel& model, const Pull& pull, const State& state, BodiesScratch& bodies, StepReport& report);

} // namespace trocar::engine
