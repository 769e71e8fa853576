// What a material's constants mean: its stiffness in a pull along one direction, free across.
#pragma once

#include "fem/tissue/material.hpp"

namespace trocar::fem {

/// J/m^3 at rest, of a deformation at a place of the rest shape; without branches that relax.
[[nodiscard]] double find_energy(const Material& material, const Mat3& deformation, const Vec3& place) noexcept;

/// Pa per stretch, of the nominal stress: the slope at a stretch of a bar pulled along its first fibres (any direction without fibres),
/// without branches that relax. At a stretch of 1, without fibres, it is Young's modulus.
[[nodiscard]] double find_pull_tangent(const Material& material, double stretch) noexcept;

} // namespace trocar::fem
