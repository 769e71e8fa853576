// Fluid forces on the rod: drag of a slender body, per length, in a flow that the rod does not disturb.
//
// This work is based on:
//   Cox 1970, "The motion of long slender bodies in a viscous fluid, part 1" (resistance across the axis is twice that along it).
//   Taylor 1952, "Analysis of the swimming of long and narrow animals" (what flows along the axis and across it resists by itself;
//   across, form drag grows with the square of the speed).
//   White 1974, "Viscous Fluid Flow", section 3 (a cylinder's drag coefficient falls towards 1 where the viscous part is gone).
// F = c w_along + (2 c + f |w_across|) w_across, N/m, with w the fluid's velocity relative to the rod's, c = 2 pi mu / ln(R / a) and
// f = rho a. Deviations: the length beyond which the fluid feels nothing of the rod is the radius R of the lumen, not the rod's
// length: so the part along the axis is that of a wire in the middle of a tube (exact for thin ones, as for the flow through the
// gap at a given pressure); the rod does not narrow or slow the flow; no torque about the axis.
#pragma once

#include "fem/rod/rod_design.hpp"
#include "fem/tissue/logarithm.hpp"

#include <algorithm>
#include <numbers>

namespace trocar::fem {

/// [-] lumen's radius over the rod's: in a narrower gap the fluid takes other paths, and the law would diverge.
inline constexpr double kLeastClearanceRatio = 1.5;

/// N s/m^2. viscosity Pa s, radii m
[[nodiscard]] inline double viscous_resistance(double viscosity, double rod_radius, double lumen_radius) noexcept {
    return 2.0 * std::numbers::pi * viscosity / natural_log(std::max(lumen_radius / rod_radius, kLeastClearanceRatio));
}

/// kg/m^2: half the density times the diameter times a drag coefficient of 1.
[[nodiscard]] inline double form_resistance(double density, double rod_radius) noexcept { return density * rod_radius; }

} // namespace trocar::fem
