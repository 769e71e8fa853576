// The largest time step an integrator takes without growth, from the mesh as it is deformed now.
// Power iteration on M^-1 K and M^-1 C for the tissue; Gershgorin rows for the contact springs, which come and go between
// two calls and would be missed by an iteration that starts from the last mode. Both squares add up (Weyl).
#pragma once

#include "fem/tissue/forces.hpp"
#include "fem/tissue/material.hpp"
#include "fem/tissue/springs.hpp"

namespace trocar::fem {

/// RK4's limit on the circle |lambda| step over damping ratios 0..1: 2.828 undamped, 2.62 at ratio 0.5, 2.785 at 1.
inline constexpr double kRk4CircleLimit = 2.6;
/// RK4's limit on the negative real axis, where overdamped modes live.
inline constexpr double kRk4RealLimit = 2.785;
/// Leapfrog's limit on omega step, undamped. With a drag taken from the step's start it shrinks by sqrt(1 + ratio^2) - ratio
/// (Belytschko, Liu & Moran 2000, section 6.2).
inline constexpr double kLeapfrogLimit = 2.0;
/// Power iteration comes from below (98-100 % after 20 rounds) and the body stiffens within the step.
inline constexpr double kStepSafety = 0.9;
/// Leapfrog without drag keeps what a mode has gained that arose between two derivations and was not found at once, as in a body that was struck: its
/// step is shorter by this share, and by less up to this ratio of damping.
inline constexpr double kUndampedShare = 0.13, kDampedRatio = 0.01;

struct StableStep {
    double step = 0.0;          // s, after all safety factors; infinite when every node is pinned, 0 when not finite
    double omega_max = 0.0;     // rad/s, fastest undamped mode, springs included
    double damping_rate = 0.0;  // 1/s, largest eigenvalue of M^-1 C, springs and mass damping included
    double tissue_omega = 0.0;  // rad/s, without the springs
    Index worst_tet = kNoIndex; // the tet in which the fastest mode lives: a sliver, or the stiffest
    bool finite = true;         // false: a force product was not finite, step is 0
};

/// The tissue's largest eigenvalues as they were last derived, without springs.
struct TissueRates {
    double elastic = 0.0, viscous = 0.0; // 1/s^2, 1/s
    Index worst_tet = kNoIndex;
};

/// Warm start: what a call takes over from the last one, and decides by.
struct StableStepMemory {
    std::vector<Vec3> mode, damping_mode; // [node_count] by record, mass-scaled, unit length
    std::vector<StiffnessNote> notes;     // [batches] how stiff every tet was when the step was derived
    TissueRates rates;
    unsigned rates_age = 0;  // sub-steps since they were derived
    bool rates_hold = false; // the notes were taken with them, and no tet has stiffened since
    bool warm = false;
    int rounds_ahead = 0; // of the next derivation, taken already
};

/// Kept by the caller, one for a body: the modes, so that the next call starts from them and needs a few rounds only.
struct StableStepWorkspace : StableStepMemory {
    std::vector<Vec3> product;
    std::vector<NodeRecord> records; // x: position, v: displacement
    std::vector<PartialForce> partial;
    std::vector<double> root_inv_mass;    // [node_count] by record, 1/sqrt(kg)
    std::vector<double> row, damping_row; // [node_count] by record, Gershgorin rows of the springs
    unsigned threads = 1;
    int cold_rounds = 30; // first call, or after warm = false
    int warm_rounds = 4;  // every call after that

    [[nodiscard]] StableStepMemory& memory() noexcept { return *this; }
    [[nodiscard]] const StableStepMemory& memory() const noexcept { return *this; }
};

/// position [node_count] m; springs may be null. Deterministic; allocates on the first call only.
[[nodiscard]] StableStep find_stable_step(const TissueModel& model, std::span<const Vec3> position, const ContactSprings* springs,
                                          StableStepWorkspace& workspace, Integrator integrator = Integrator::Rk4);
/// The same of records in the plan's order.
[[nodiscard]] StableStep find_stable_step(const TissueModel& model, std::span<const NodeRecord> records, const ContactSprings* springs,
                                          StableStepWorkspace& workspace, Integrator integrator);

/// From the tissue's rates as they were last derived and the springs as they are now: no force evaluation. For a body whose
/// tets have not stiffened beyond KeptGrowth since.
[[nodiscard]] StableStep find_stable_step_again(const TissueModel& model, const ContactSprings* springs, StableStepWorkspace& workspace,
                                                Integrator integrator);

/// A round of the next derivation, taken while the last one still holds: spread over the steps before it, it is no longer the one step
/// that takes twice as long as all others. For a workspace that is warm, while there are rounds to come: the last one, which tells the
/// elastic rate, is left to the derivation itself.
/// records [node_count] in the plan's order
[[nodiscard]] int rounds_to_come(const TissueModel& model, const StableStepWorkspace& workspace) noexcept;
void derive_ahead(const TissueModel& model, std::span<const NodeRecord> records, StableStepWorkspace& workspace);

/// How much any tet may stiffen, by a bound on its tangent, before the step is derived again. If all of them stiffen alike, the
/// frequency grows with the root. Undamped, RK4's derived step bears a growth of 1.46 ((2.828 / (2.6 kStepSafety))^2),
/// leapfrog's one of 1.23; power iteration takes 1.04 of that.
struct KeptGrowth {
    double settled; // from kLeastKept sub-steps on
    double at_once; // before that: one tet of many stiffens so much in a lively body, and seldom alone sets the step
};
[[nodiscard]] constexpr KeptGrowth kept_growth(Integrator integrator) noexcept {
    return integrator == Integrator::Rk4 ? KeptGrowth{1.1, 1.4} : KeptGrowth{1.05, 1.15};
}
inline constexpr unsigned kLeastKept = 8; // sub-steps; a derivation costs as much as two of RK4's, or six of leapfrog's
/// A sub-step within which a tet stiffens to this is not taken.
inline constexpr double kRejectedGrowth = 2.0;

/// The largest viscosity, at most the model's own, that costs no more than kViscousStepShare of the step without it. Exact
/// at rest: drag is linear in the viscosity.
[[nodiscard]] double cap_viscosity(const TissueModel& model, const StableStep& at_rest, Integrator integrator) noexcept;

/// Drag on the strain rate grows with the square of the mesh's frequencies: unlimited it would set the stable step of the body.
inline constexpr double kViscousStepShare = 0.1;

/// How many equal sub-steps of at most `stable.step` cover `step`; 0 when the limit is 0 or more than max_substeps are needed.
[[nodiscard]] unsigned count_substeps(double step, const StableStep& stable, unsigned max_substeps) noexcept;

} // namespace trocar::fem
