// The largest time step an integrator takes without growth, from the mesh as it is deformed now.
// Power iteration on M^-1 K and M^-1 C for the tissue; Gershgorin rows for the contact springs, which come and go between
// two calls and would be missed by an iteration that starts from the last mode. Both squares add up (Weyl).
#pragma once

#include "fem/forces.hpp"
#include "fem/integrator.hpp"
#include "fem/springs.hpp"

namespace seldinger::fem {

/// RK4's limit on the circle |lambda| step over damping ratios 0..1: 2.828 undamped, 2.62 at ratio 0.5, 2.785 at 1.
inline constexpr double kRk4CircleLimit = 2.6;
/// RK4's limit on the negative real axis, where overdamped modes live.
inline constexpr double kRk4RealLimit = 2.785;
/// Leapfrog's limit on omega step, undamped. With a drag taken from the step's start it shrinks by sqrt(1 + ratio^2) - ratio
/// (Belytschko, Liu & Moran 2000, section 6.2).
inline constexpr double kLeapfrogLimit = 2.0;
/// Power iteration comes from below (98-100 % after 20 rounds) and the body stiffens within the step.
inline constexpr double kStepSafety = 0.9;

struct StableStep {
    double step = 0.0;           // s, after all safety factors; infinite when every node is pinned, 0 when not finite
    double omega_max = 0.0;      // rad/s, fastest undamped mode, springs included
    double damping_rate = 0.0;   // 1/s, largest eigenvalue of M^-1 C, springs and mass damping included
    double tissue_omega = 0.0;   // rad/s, without the springs
    Index worst_tet = kNoIndex;  // the tet in which the fastest mode lives: a sliver, or the stiffest
    bool finite = true;          // false: a force product was not finite, step is 0
};

/// Kept by the caller: the modes, so that the next call starts from them and needs a few rounds only.
struct StableStepWorkspace {
    std::vector<Vec3> mode, damping_mode; // [node_count] by record, mass-scaled, unit length
    std::vector<Vec3> product;
    std::vector<NodeRecord> records;       // x: position, v: displacement
    std::vector<PartialForce> partial;
    std::vector<double> root_inv_mass;     // [node_count] by record, 1/sqrt(kg)
    std::vector<double> row, damping_row;  // [node_count] by record, Gershgorin rows of the springs
    unsigned threads = 1;
    bool warm = false;
    int cold_rounds = 30; // first call, or after warm = false
    int warm_rounds = 4;  // every call after that
};

/// position [node_count] m; springs may be null. Deterministic; allocates on the first call only.
[[nodiscard]] StableStep find_stable_step(const TissueModel& model, std::span<const Vec3> position,
                                          const ContactSprings* springs, StableStepWorkspace& workspace,
                                          Integrator integrator = Integrator::Rk4);
/// The same of records in the plan's order.
[[nodiscard]] StableStep find_stable_step(const TissueModel& model, std::span<const NodeRecord> records,
                                          const ContactSprings* springs, StableStepWorkspace& workspace, Integrator integrator);

/// The largest viscosity, at most the model's own, that costs no more than kViscousStepShare of the step without it. Exact
/// at rest: drag is linear in the viscosity.
[[nodiscard]] double cap_viscosity(const TissueModel& model, const StableStep& at_rest, Integrator integrator) noexcept;

/// Drag on the strain rate grows with the square of the mesh's frequencies: left alone it would set the step of the body.
inline constexpr double kViscousStepShare = 0.1;

/// How many equal sub-steps of at most `stable.step` cover `step`; 0 when the limit is 0 or more than max_substeps are needed.
[[nodiscard]] unsigned count_substeps(double step, const StableStep& stable, unsigned max_substeps) noexcept;

} // namespace seldinger::fem
