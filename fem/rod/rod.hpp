// The catheter's rod: a chain of nodes with bending and stretch, solved implicitly in linear time, so that the stiffness
// of polymer or nitinol does not dictate the step. It is independent of the vessel: contacts reach it as half-space planes.
//
// This work is based on:
//   Bergou, Wardetzky, Robinson, Audoly, Grinspun 2008, "Discrete Elastic Rods" (twist-free frames carried from the base).
//   Baraff & Witkin 1998, "Large Steps in Cloth Simulation" (implicit Euler, semi-definite stretch Hessian).
// Deviations: bending is the squared second difference of positions against its rest vector, exact in the limit of small
// turning angle per node (the moment is 4 % low at 0.5 rad); frames are lagged by one sub-step; without RodDesign::torsion
// twist is quasi-static, so that a turn of the handle reaches the tip within the sub-step (with it: rod_twist.hpp).
#pragma once

#include "fem/rod/rod_frames.hpp"
#include "fem/rod/rod_model.hpp"

#include <span>

namespace trocar::fem {

/// Straight rod on the port's axis, at rest, `insertion` metres in.
void place_rod(const RodModel& model, const RodPort& port, double insertion, double rotation, RodState& state);

/// Advances by `step` seconds in `substeps` steps of two stages each. Planes hold for the whole step.
/// self      planes that places of the rod itself carry (RodPlane::other): both places feel the force, one along the normal and the other
///           against it
/// cost      O(node_count) a Newton iteration: banded LDL^T, half bandwidth 8; where the rod presses on itself a substitution more for each
///           of the conjugate gradients' iterations
/// fails     never; a state that is not finite is reported by node
RodReport solve_rod(const RodModel& model, RodState& state, double step, unsigned substeps, const RodDrive& drive,
                    std::span<RodPlane> planes, RodWorkspace& workspace, std::span<RodPlane> self = {}) noexcept;

/// First node that has passed the port; node_count where none has.
[[nodiscard]] Index first_inserted_node(const RodModel& model, double insertion) noexcept;

/// Is all of it beyond the port? Then nothing holds it there.
[[nodiscard]] inline bool is_free(const RodModel& model, double insertion) noexcept { return first_inserted_node(model, insertion) == 0; }

/// Arc length from the port of a place between nodes, at rest, m; negative behind it.
[[nodiscard]] inline double arc_of(const RodModel& model, double insertion, double place) noexcept {
    return insertion - (static_cast<double>(model.node_count() - 1) - place) * model.segment;
}

} // namespace trocar::fem
