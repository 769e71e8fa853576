// Bodies that touch are advanced side by side, with one sub-step for all of them: velocity Verlet in parts, between which contact changes
// velocities. Each part is one body's:
//   kick(h / 2); repeat { contact changes velocities; drift(h); find_forces(); kick(h) }, the last kick again of h / 2.
// Internal forces have no sum and no moment where they are evaluated, and a drift moves every node along its own momentum: linear and
// angular momentum are kept to rounding, whatever the sub-step.
//
// This work is based on: Swope, Andersen, Berens & Wilson 1982 (velocity Verlet). Drag takes the velocity at the sub-step's middle before
// the kick, as leapfrog's does (integrate.hpp): the same stable step.
#pragma once

#include "fem/tissue/substep.hpp"

namespace trocar::fem {

class TissueLockstep {
public:
    /// All that it is given outlives it. step: s, of the whole; limits.integrator is Leapfrog's.
    TissueLockstep(const TissueModel& model, TissueState& state, double step, const IntegrateInputs& inputs, const SubstepLimits& limits,
                   RkWorkspace& workspace, StableStepWorkspace& stable);

    /// Forces where the nodes stand, `time` s after the start, and how long a sub-step from here may be, s; the stable step is derived again
    /// where a tet has stiffened. `taken`: s, the sub-step that led here. 0: not finite.
    double find_forces(double time, double taken);

    /// v += h a, of the forces that were found last. False: not finite, and the state is the last good one.
    bool kick(double h);

    /// x += h v
    void drift(double h) noexcept;

    /// [node_count] in the plan's order: contact changes velocities here.
    [[nodiscard]] std::span<NodeRecord> nodes() noexcept { return w_.start; }
    [[nodiscard]] const TissueModel& model() const noexcept { return model_; }

    /// Into the state. arrived: the whole step was taken. refused: it would have taken more than limits.max_substeps.
    AdvanceReport finish(bool arrived, bool refused);

private:
    const TissueModel& model_;
    TissueState& state_;
    double step_;
    const IntegrateInputs& inputs_;
    SubstepLimits limits_;
    RkWorkspace& w_;
    StableStepWorkspace& stable_;
    AdvanceReport report_;
    StiffnessWatch watch_;
    StableStep now_;
    double time_ = 0.0;
};

} // namespace trocar::fem
