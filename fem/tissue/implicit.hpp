// A body advanced implicitly: as few sub-steps as a step has, however stiff, thin or small its tetrahedra are.
//
// Two stages a sub-step of h, each one implicit Euler of g h, g = 1 - 1/sqrt(2), from where the first leads to (second order, L-stable:
// what swings faster than the sub-step is damped away). A stage looks for the nodes' places x with
//   r(x) = f(x, v) + springs + pressures + loads + m g - mass_damping m v - m (v - v0) / (g h) = 0,      v = (x - x0) / (g h)
// by Newton's method. The linear systems A d = r, A = M ((g h)^-2 + mass_damping (g h)^-1) + K(x) + C(x) (g h)^-1 + springs, are solved by
// conjugate gradients with the tissue's tangent product (TetKernel::Stiffness; of Ogden's law and of fibres, where that is a bound, a central difference of
// the forces), preconditioned by the sparse factor of A at rest, which is found once. A Newton step is shortened where what is left would push back along it: every force but viscosity's and the rims of what is under pressure has an energy, which falls that way.
//
// This work is based on: Baraff & Witkin 1998 (implicit steps by conjugate gradients); Alexander 1977 (the two stages). Deviates: Newton's method to its end, not
// one linearised step. Bodies that are tied to one another are solved as one system, each preconditioned by its own factor. A stage ends where the next correction, by the factor at rest, is below 1e-7 of an edge and below 1e-2 of its first one.
#pragma once

#include "fem/tissue/implicit_system.hpp"
#include "fem/tissue/integration.hpp"
#include "fem/tissue/ties.hpp"

namespace trocar::fem {

struct ImplicitWorkspace {
    std::vector<NodeRecord> known, probe;                                          // [node_count] by record: x0, v0; x, direction
    std::vector<Vec3> residual, correction, direction, product, step, before; // [node_count] by record
    std::vector<std::array<float, 4>> scratch;                                     // [node_count]
    std::vector<PartialForce> ahead;                                               // [slots] branches that relax, a little further
};

struct ImplicitWork {
    unsigned newton = 0;     // linear systems solved
    unsigned iterations = 0; // of conjugate gradients
    double unsolved = 0.0;   // m, what was left where the shortest sub-step did not converge either; 0: all did
};

struct ImplicitReport : ImplicitWork {
    AdvanceReport advance; // tightest.step: s, of the shortest sub-step taken
};

/// One of several that are advanced together; all that it names outlives the call.
struct ImplicitBody {
    const TissueModel& model;
    const ImplicitSystem& system;
    TissueState& state;
    const IntegrateInputs& inputs;
    RkWorkspace& workspace;
    ImplicitWorkspace& implicit;
    AdvanceReport& advance; // as ImplicitReport's; all bodies take the same sub-steps
};

/// Ties of one of these bodies to another: places in their list.
struct TiedBodies {
    std::size_t body = 0, host = 0;
    std::span<const Tie> ties;
};

/// Over `step` s in `substeps` equal sub-steps; one that does not converge is taken again at half its length, down to 1/64; refused where
/// that does not converge either, or takes too many iterations. Then the state is where it got to. Deterministic; allocates in the
/// first call only. What relaxes (Maxwell branches) follows at the end of a sub-step.
ImplicitWork advance_implicitly(std::span<const ImplicitBody> bodies, std::span<const TiedBodies> ties, double step, unsigned substeps);
/// The same of a body by itself.
ImplicitReport advance_implicitly(const TissueModel& model, const ImplicitSystem& system, TissueState& state, double step, unsigned substeps,
                                  const IntegrateInputs& inputs, RkWorkspace& workspace, ImplicitWorkspace& implicit);

} // namespace trocar::fem
