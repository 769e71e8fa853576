// A body advanced implicitly: as few sub-steps as a step has, however stiff, thin or small its tetrahedra are.
//
// Two stages a sub-step of h, each one implicit Euler of g h, g = 1 - 1/sqrt(2), from where the first leads to (second order, L-stable:
// what swings faster than the sub-step is damped away). A stage looks for the nodes' places x with
//   r(x) = f(x, v) + springs + pressures + loads + m g - mass_damping m v - m (v - v0) / (g h) = 0,      v = (x - x0) / (g h)
// by Newton's method. The linear systems A d = r, A = M ((g h)^-2 + mass_damping (g h)^-1) + K(x) + C(x) (g h)^-1 + springs, are solved by
// conjugate gradients with the tissue's exact tangent product (TetKernel::Stiffness), preconditioned by the sparse factor of A at rest,
// which is found once. A Newton step is shortened where what
// is left would push back along it: every force but viscosity's and the rims of what is under pressure has an energy, which falls that way.
//
// This work is based on: Baraff & Witkin 1998 (implicit steps by conjugate gradients); Alexander 1977 (the two stages). Deviates: no linearised single step, so that what is left over is known and bounded.
#pragma once

#include "fem/tissue/implicit_system.hpp"
#include "fem/tissue/integration.hpp"

namespace trocar::fem {

struct ImplicitWorkspace {
    std::vector<NodeRecord> known, probe;                                          // [node_count] by record: x0, v0; x, direction
    std::vector<Vec3> residual, correction, direction, product, step, before; // [node_count] by record
    std::vector<std::array<float, 4>> scratch;                                     // [node_count]
    std::vector<PartialForce> ahead;                                               // [slots] branches that relax, a little further
};

struct ImplicitReport {
    AdvanceReport advance;        // tightest.step: s, of the shortest sub-step taken
    unsigned newton = 0;          // linear systems solved
    unsigned iterations = 0;      // of conjugate gradients
    double unsolved = 0.0;        // m, what was left where the shortest sub-step did not converge either; 0: all did
};

/// Over `step` s in `substeps` equal sub-steps; one that does not converge is taken again in two halves, down to 1/64 of it. Deterministic; allocates in the
/// first call only. What relaxes (Maxwell branches) follows at the end of a sub-step.
ImplicitReport advance_implicitly(const TissueModel& model, const ImplicitSystem& system, TissueState& state, double step, unsigned substeps,
                                  const IntegrateInputs& inputs, RkWorkspace& workspace, ImplicitWorkspace& implicit);

} // namespace trocar::fem
