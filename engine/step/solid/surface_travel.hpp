// How far surfaces go in a step, and how thick bodies are.
#pragma once

#include "engine/step/solid/solid_scratch.hpp"

#include <span>

namespace trocar::engine {

/// How far a body's surface goes in the step; found once in refresh.
[[nodiscard]] SurfaceTravel find_motion(std::span<const Vec3> t0, std::span<const Vec3> t1) noexcept;

/// m; no vertex of one moves by more than this against any of the other in the step.
[[nodiscard]] double find_relative_way(const SurfaceTravel& a, const SurfaceTravel& b) noexcept;

/// m; extent along the thinnest principal axis of the points.
[[nodiscard]] double find_thickness(std::span<const Vec3> points);

} // namespace trocar::engine
