// Classical Runge-Kutta 4 over equal sub-steps. Pinned nodes move linearly to their target; the springs and the tissue are
// evaluated in all four stages.
#pragma once

#include "fem/forces.hpp"
#include "fem/springs.hpp"

namespace seldinger::fem {

struct IntegrateInputs {
    Vec3 gravity = Vec3::Zero();           // m/s^2
    const ContactSprings* springs = nullptr;
    std::span<const Vec3> pinned_target;   // [pinned.size()] m, where the pinned nodes are at the end; empty: they stay
    std::span<const Vec3> external_force;  // [node_count] N, constant over the step; empty: none
};

struct IntegrateReport {
    double min_volume_ratio = 1.0;   // [-], over every stage of every sub-step
    Index min_volume_tet = kNoIndex;
    std::uint32_t inverted = 0;      // tets with det F <= 0 at the end
    double elastic_j = 0.0;          // J at the end
    double kinetic_j = 0.0;          // J at the end
    unsigned substeps_done = 0;
    Index first_bad_node = kNoIndex; // kNoIndex: every state was finite
    Index first_bad_tet = kNoIndex;  // the first tet whose force was not finite, when that was the cause

    [[nodiscard]] bool finite() const noexcept { return first_bad_node == kNoIndex; }
};

struct RkWorkspace {
    std::vector<Vec3> start_position, start_velocity, stage_position, stage_velocity, force;
    std::vector<Vec3> slope_position, slope_velocity; // weighted sums of the four slopes
};

/// Advances by `step` seconds in `substeps` equal parts. Allocates on the first call only.
/// A sub-step that would produce a value that is not finite is not taken: the state stays at the last finite sub-step and
/// the report names the first bad node and tet.
IntegrateReport integrate_rk4(const TissueModel& model, TissueState& state, double step, unsigned substeps,
                              const IntegrateInputs& inputs, RkWorkspace& workspace) noexcept;

/// Sum of m v and of x cross m v over all nodes: diagnostics and tests.
struct Momentum { Vec3 linear = Vec3::Zero(), angular = Vec3::Zero(); };
[[nodiscard]] Momentum find_momentum(const TissueModel& model, const TissueState& state) noexcept;

} // namespace seldinger::fem
