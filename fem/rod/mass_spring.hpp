// The catheter as a chain of masses with springs, integrated explicitly: what the examples of Govindaraju et al. 2005 use.
//
// This work is based on:
//   Govindaraju, Knott, Jain, Kabul, Tamstorf, Gayle, Lin, Manocha 2005, "Interactive Collision Detection between Deformable
//   Models using Chromatic Decomposition", section 6 (a catheter "modeled as a mass-spring system with 10K triangles").
// Deviations: the masses are the rod's nodes and the 10K triangles a skin that follows them; springs stretch between
// neighbours and bend on second differences, with the stiffnesses E A and E I of the same section; sub-steps are derived.
// A turn of the handle reaches the tip at once. Walls push by impulses, not by springs: docs/contact.md.
#pragma once

#include "fem/rod/rod.hpp"

namespace trocar::fem {

/// More sub-steps than this in one step are refused: a step would take seconds.
inline constexpr double kMostMassSpringSubsteps = 20000.0;

/// s; stable sub-step of the chain: 0.9 of 2 / omega, omega^2 the sum of what stretch and bending bring at most.
/// source    Gershgorin's bound: 4 k / m of a chain's stretch, 16 k / m of its bending
[[nodiscard]] double mass_spring_substep(const RodModel& model) noexcept;

/// Sub-steps of a step of `step` seconds; fails where they are more than kMostMassSpringSubsteps, with what would help.
[[nodiscard]] Result<unsigned> count_mass_spring_substeps(const RodModel& model, double step);

/// As solve_rod, by semi-implicit Euler: forces explicit, drag implicit, walls and friction by impulses on the velocities. Torsion and coaxial rods it does not know.
/// cost      O(node_count) a sub-step
/// fails     never; a state that is not finite is reported by node
RodReport solve_mass_spring(const RodModel& model, RodState& state, double step, unsigned substeps, const RodDrive& drive,
                            std::span<RodPlane> planes, RodWorkspace& workspace) noexcept;

} // namespace trocar::fem
