// What every integration of a body is given, and what it comes to: integrate.hpp, lockstep.hpp.
#pragma once

#include "fem/tissue/forces.hpp"
#include "fem/tissue/springs.hpp"
#include "fem/tissue/stable_step.hpp"

namespace trocar::fem {

/// A pressure on a triangle of nodes, against its normal, as it stands in every sub-step: held from the start of a longer step it would follow the body
/// late, and drive light nodes to and fro.
struct FacePressure {
    Triangle nodes;
    double pressure;   // Pa, at the step's start
    double rate = 0.0; // Pa/s, all through the step

    [[nodiscard]] double at(double time) const noexcept { return pressure + rate * time; } // s, since the step's start
};

struct IntegrateInputs {
    Vec3 gravity = Vec3::Zero(); // m/s^2
    const ContactSprings* springs = nullptr;
    std::span<const Vec3> pinned_target = {};  // [pinned.size()] m, where the pinned nodes are at the end; empty: they stay
    std::span<const Vec3> external_force = {}; // [node_count] N, at the step's start; empty: none
    std::span<const Vec3> force_rate = {};     // [node_count] N/s, all through the step; empty: the force is constant, or there is none
    std::span<const FacePressure> pressures = {};
};

struct IntegrateReport {
    // of the state at the end, which the caller gets: min_volume_ratio <= 0 if and only if inverted > 0
    double min_volume_ratio = 1.0; // [-] det F of the most compressed tet
    Index min_volume_tet = kNoIndex;
    std::uint32_t inverted = 0; // tets with det F <= 0
    double elastic_j = 0.0;     // J
    double kinetic_j = 0.0;     // J
    unsigned substeps_done = 0;
    Index first_bad_node = kNoIndex; // kNoIndex: every state was finite
    Index first_bad_tet = kNoIndex;  // the first tet whose force was not finite, when that was the cause
    /// [-] smallest det F at which a force was evaluated: stages within sub-steps too, also of sub-steps that were not taken. No state has
    /// it; where the integration fails it says what led there.
    double least_stage_ratio = 1.0;

    [[nodiscard]] bool finite() const noexcept { return first_bad_node == kNoIndex; }
};

/// All in the plan's order.
struct RkWorkspace {
    std::vector<NodeRecord> start, stage, slope; // [node_count] state, where forces are evaluated, weighted sum of slopes
    std::vector<PartialForce> partial;           // [slots]
    std::vector<PartialForce> extra;             // [node_count] N, springs and external forces
    std::vector<TetSum> sums;                    // [chunks]
    std::span<double> relaxed;                   // of the state in hand
    std::uint64_t evaluations = 0;               // of forces at all nodes, counted on; for whoever reports them
    unsigned threads = 1;                        // the bits are the same for any number
};

/// How far the derived sub-steps may go.
struct SubstepLimits {
    Integrator integrator = Integrator::Rk4;
    double longest = std::numeric_limits<double>::infinity(); // s, that a sub-step may be, where stability would allow more
    unsigned max_substeps = 2000;        // per call; more are needed: refused, the state stays where it got to
    unsigned substeps_per_estimate = 64; // >= 1; the stable step is derived again after so many, and whenever a tet stiffens
};

struct AdvanceReport {
    IntegrateReport integrate;
    StableStep tightest;       // the smallest stable step met
    unsigned estimates = 0;    // times the stable step was derived; 0: an earlier call's still holds
    unsigned rejected = 0;     // sub-steps not taken because a tet stiffened within them
    double time_done = 0.0;    // s, = step when all went well
    double last_substep = 0.0; // s, length of the last sub-step taken; 0: none was
    bool refused = false;      // max_substeps was not enough: tightest.step and worst_tet say why
    bool instead = false;      // an implicit step did not converge: explicit sub-steps took its place
};

} // namespace trocar::fem
