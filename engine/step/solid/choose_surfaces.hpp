// Which surfaces of solids a step looks at, and what it leaves: the budget's side of find_touches (solid_touch.hpp).
#pragma once

#include "engine/state/step_report.hpp"
#include "engine/step/solid/solid_scratch.hpp"
#include "engine/step/solid/surface_account.hpp"

namespace trocar::engine {

/// Fills solids.meeting with the bodies whose surfaces there is reason to look at, solids.looked with those that there is room for, those
/// that touched in the last step first, and makes these ready: the boxes, normals and motion of this step. The others are the first of
/// solids.left_bodies.
void choose_looked(const SceneModel& model, const State& state, SolidScratch& solids, SurfaceAccount& account);

/// After find_touches: orders what was found and what was left, and keeps what the next step needs of it.
void list_what_is_left(const SceneModel& model, State& state, SolidScratch& solids, StepReport& report);

/// Are the surfaces of two bodies looked at in this step?
[[nodiscard]] bool is_looked(const SolidScratch& solids, std::size_t a, std::size_t b) noexcept;

/// Of two bodies that solids.left_bodies names and that are looked at: did this step leave what is beneath this contact of spheres?
[[nodiscard]] bool is_left(const SolidScratch& solids, const Contact& spheres) noexcept;

/// What the surfaces of what touched, or was held, in the last step will ask for.
[[nodiscard]] SurfaceNeed forecast_surfaces(const SceneModel& model, const State& state, SolidScratch& solids);

} // namespace trocar::engine
