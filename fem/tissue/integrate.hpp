// Time integration over equal sub-steps: classical Runge-Kutta 4 (tissue and springs in all four stages), or leapfrog with
// one evaluation in the middle (position Verlet; a drag sees the velocity at the sub-step's start). Pinned nodes move linearly
// to their target.
#pragma once

#include "fem/tissue/integration.hpp"

namespace trocar::fem {

/// Advances by `step` seconds in `substeps` > 0 equal parts. Allocates on the first call only.
/// A sub-step that would produce a value that is not finite is not taken: the state stays at the last finite sub-step and
/// the report names the first bad node and tet.
IntegrateReport integrate(const TissueModel& model, TissueState& state, double step, unsigned substeps, const IntegrateInputs& inputs,
                          Integrator integrator, RkWorkspace& workspace) noexcept;
IntegrateReport integrate_rk4(const TissueModel& model, TissueState& state, double step, unsigned substeps, const IntegrateInputs& inputs,
                              RkWorkspace& workspace) noexcept;
/// One force evaluation a sub-step, second order, symplectic without damping. It wants equal frames: what it conserves is a
/// neighbour of the energy that depends on the step, and a step that goes back and forth near its limit pumps energy. RK4 is
/// not affected.
IntegrateReport integrate_leapfrog(const TissueModel& model, TissueState& state, double step, unsigned substeps,
                                   const IntegrateInputs& inputs, RkWorkspace& workspace) noexcept;

/// Advances by `step` in as many sub-steps as the body's stiffness asks for at the time. A derived step is kept, over calls too,
/// until some tet has stiffened too much for it (KeptGrowth): every force evaluation checks. A sub-step in which a tet stiffens to
/// kRejectedGrowth is not taken: the step is derived again, and halved where that alone does not help. At the worst the call
/// is refused, the state finite and where time_done says.
AdvanceReport advance(const TissueModel& model, TissueState& state, double step, const IntegrateInputs& inputs, const SubstepLimits& limits,
                      RkWorkspace& workspace, StableStepWorkspace& stable_workspace);

/// Sum of m v and of x cross m v over all nodes: diagnostics and tests.
struct Momentum {
    Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();
};
[[nodiscard]] Momentum find_momentum(const TissueModel& model, const TissueState& state) noexcept;

} // namespace trocar::fem
