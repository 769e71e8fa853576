// What every integrator of a body does in a sub-step: forces at where the nodes stand, their update, and the watch on elements that
// stiffen. Internal to the tissue's integrators (integrate.cpp, lockstep.cpp).
#pragma once

#include "fem/tissue/integration.hpp"

#include <algorithm>

namespace trocar::fem {

enum class StageOutcome : std::uint8_t { Fine, NotFinite, Stiffened };

/// Detects that a tet has stiffened since the step was derived.
struct StiffnessWatch {
    TetGrowth growth;
    double largest = 1.0; // growth met so far
    [[nodiscard]] bool trips(double grown) noexcept {
        growth.use = TetGrowth::Use::Compare;
        largest = std::max(largest, grown);
        return grown > kRejectedGrowth;
    }
};

/// Whether the step of the last derivation still holds at a tet's largest growth since.
[[nodiscard]] bool holds(const StableStepWorkspace& w, const SubstepLimits& limits, double growth) noexcept;

/// The same at the start of a call, of a body that may be another.
[[nodiscard]] bool can_keep(const TissueModel& model, const StableStepWorkspace& w, const SubstepLimits& limits) noexcept;

/// The first evaluation after a derivation notes how stiff every tet is, all others compare.
[[nodiscard]] StiffnessWatch make_watch(const ForcePlan& plan, StableStepWorkspace& w, bool derived);

/// Inputs of a sub-step.
struct Substep {
    const TissueModel& model;
    const IntegrateInputs& inputs;
    RkWorkspace& w;
    StiffnessWatch* watch; // may be null
    IntegrateReport& report;
    double time = 0.0; // s, of its start, since the step's, at which the springs were made
};

/// Forces at `now`, which stands for `since` (s) after the sub-step's start, into w.partial. False: a tet has stiffened too much.
[[nodiscard]] bool find_forces(const Substep& s, std::span<const NodeRecord> now) noexcept;

/// Springs, pressures and external forces at `now`, `since` the sub-step's start, by record; null where there are none.
[[nodiscard]] const PartialForce* find_extra(const Substep& s, double since, std::span<const NodeRecord> now) noexcept;

/// Every node's update from those forces, from what pushes from outside, and from gravity, into w.stage. Not Fine: the report names the bad
/// node and tet; w.start is as it was.
StageOutcome update_stage(const Substep& s, double since, std::span<const NodeRecord> now, NodeUpdate update, double reach,
                          double drift) noexcept;

/// Checks sizes, sets the pinned nodes' velocities and gathers the records.
void begin_substeps(const TissueModel& model, TissueState& state, double step, const IntegrateInputs& inputs, RkWorkspace& w,
                    IntegrateReport& report);

/// What relaxes in a sub-step of h seconds that led to w.start.
void follow_relaxation(const TissueModel& model, RkWorkspace& w, double h) noexcept;

/// Sets pinned nodes exactly to their targets where they arrived, and computes the end's energies.
void finish_substeps(const TissueModel& model, TissueState& state, const IntegrateInputs& inputs, bool arrived, RkWorkspace& w,
                     IntegrateReport& report) noexcept;

} // namespace trocar::fem
