// Stage 2 and 3 of a step: deformable bodies are integrated, kinematic ones moved, dense surfaces follow.
#pragma once

#include "engine/step/context.hpp"
#include "engine/step/scripted_motion.hpp"

namespace trocar::engine {

/// Remembers where everything is before the step moves it, but for the surfaces.
void keep_start(const SceneModel& model, const State& state, StepContext& context);

/// Remembers those, without a copy: until update_embedded_surfaces they stand where they stood a step earlier. Those that nothing in the step looks
/// at are not remembered.
void keep_surfaces(const SceneModel& model, State& state, StepContext& context);

/// Puts everything back to what keep_start and keep_surfaces remembered.
void restore_start(const SceneModel& model, State& state, StepContext& context);

/// Places the vertices of a surface that waits for somebody to look at it.
void place_surface(const SceneModel& model, std::size_t body, State& state) noexcept;

/// Integrates every deformable body over the step with the springs of the last response. On a value that is not finite,
/// or when more sub-steps than allowed are needed, the report says which body, element and number.
void integrate_bodies(const SceneModel& model, State& state, StepContext& context);

/// Dense surfaces to the end of the step: linked ones follow their coarse mesh, kinematic ones their path.
void update_embedded_surfaces(const SceneModel& model, State& state, StepContext& context);

} // namespace trocar::engine
