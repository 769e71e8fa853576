// Where a body comes to rest: what the dynamic engine is compared with, and never part of a step.
#pragma once

#include "fem/tissue/tissue.hpp"

namespace trocar::fem {

/// Small-strain displacement [node_count] m under nodal forces [node_count] N: conjugate gradients on the stiffness at rest,
/// pinned nodes held. Stops at a residual of 1e-10 of the force, or after 4000 rounds.
[[nodiscard]] std::vector<Vec3> solve_small_strain(const TissueModel& model, std::span<const Vec3> force);

struct Equilibrium {
    std::vector<Vec3> position; // [node_count] m
    double residual = 0.0;      // [-] largest force left on a free node over the largest applied
};

/// Equilibrium under dead nodal forces by Newton's method in `increments` equal load steps. Read the residual: a body that buckles does
/// not converge.
[[nodiscard]] Equilibrium find_equilibrium(const TissueModel& model, std::span<const Vec3> force, int increments);

} // namespace trocar::fem
