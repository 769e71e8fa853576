// Stage 2 and 3 of a step: deformable bodies are integrated, kinematic ones moved, dense surfaces follow.
#pragma once

#include "engine/state/step_report.hpp"
#include "engine/step/tissue/tissue_scratch.hpp"
#include "engine/time/step_budget.hpp"

namespace trocar::engine {

/// Notes where the bodies are before the step moves them, but for their surfaces.
void keep_bodies(const SceneModel& model, const State& state, BodiesScratch& bodies);

/// Remembers those, without a copy: until update_embedded_surfaces they stand where they stood a step earlier. Those that nothing in the step looks
/// at are not remembered.
void keep_surfaces(const SceneModel& model, State& state, BodiesScratch& bodies);

/// Puts them back to what keep_bodies and keep_surfaces noted.
void restore_bodies(const SceneModel& model, State& state, const BodiesScratch& bodies);

/// Places the vertices of a surface that waits for somebody to look at it.
void place_surface(const SceneModel& model, std::size_t body, State& state) noexcept;

/// Integrates every deformable body over the step with the springs of the last response.
/// live   effects of this step
/// On a value that is not finite,
/// or when more sub-steps than allowed are needed, the report says which body, element and number.
void integrate_bodies(const SceneModel& model, const EffectSet& live, State& state, BodiesScratch& bodies, StepReport& report,
                      StepBudget& budget);

/// Dense surfaces to the end of the step: linked ones follow their coarse mesh, kinematic ones their path.
void update_embedded_surfaces(const SceneModel& model, const EffectSet& live, State& state, const BodiesScratch& bodies,
                              StepReport& report);

} // namespace trocar::engine
