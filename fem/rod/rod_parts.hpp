// Parts of a rod's solve that all its integrators share. Internal to fem.
#pragma once

#include "fem/rod/rod_model.hpp"

#include <array>
#include <vector>

namespace trocar::fem {

[[nodiscard]] inline Vec3 second_difference(const std::vector<Vec3>& x, std::size_t i) noexcept { return x[i - 1] - 2.0 * x[i] + x[i + 1]; }

/// What pulls on the tip at a time since the step's start, s.
inline void set_tip_load(const RodDrive& drive, double since, RodWorkspace& work) noexcept {
    work.tip_force = drive.tip.force + since * drive.tip.force_rate;
    work.tip_torque = drive.tip.torque + since * drive.tip.torque_rate;
}

/// m, of segment i at rest.
[[nodiscard]] inline double rest_length(const RodModel& model, std::size_t i) noexcept {
    return model.rest_length.empty() ? model.segment : model.rest_length[i];
}

/// Weights of nodes i - 1, i, i + 1 whose sum is 0 where the rod is straight: second difference, or with unlike segments the
/// change of the unit edge.
[[nodiscard]] inline std::array<double, 3> bend_stencil(const RodModel& model, std::size_t i) noexcept {
    if (model.rest_length.empty()) return {1.0, -2.0, 1.0};
    const double before = 1.0 / model.rest_length[i - 1], after = 1.0 / model.rest_length[i];
    return {before, -(before + after), after};
}

void size_workspace(std::size_t nodes, RodWorkspace& workspace);

/// Frames of the current configuration rotate its rest curvature into the world: workspace.axis, tangent, rest_bend.
void find_rest_bend(const RodModel& model, const RodState& state, const RodPort& port, RodWorkspace& workspace) noexcept;

/// How much of the segment behind node `first` has passed the port, [-] of its length, at least a fiftieth: that much of it
/// bends, twists and stretches. So what is clamped half a segment behind the port stays there, and a node comes in as stiff
/// as it stood before the port. The rest keeps the stiffness finite, at a jump of a quarter of a per cent in 25 segments.
[[nodiscard]] double inserted_share(const RodModel& model, double insertion, Index first) noexcept;

/// Nodes before `first` to their places on the port's axis.
void move_behind_port(const RodModel& model, const RodPort& port, double insertion, double dt, Index first, RodState& state) noexcept;

/// The nodes of the last segment are held by a clamp; node_count where there is none.
[[nodiscard]] Index first_clamped_node(const RodModel& model, const RodDrive& drive) noexcept;
/// Part of a force or a motion that a clamp leaves the nodes that it holds.
[[nodiscard]] Mat3 clamp_freedom(const RodDrive& drive) noexcept;

/// Of what is left to where the clamp ends, takes the share `part`: both nodes' places, and the angle of the tip.
/// tangent, axis   unit, of the tip's frame where the stage began
void move_clamp(const RodModel& model, const RodClamp& clamp, double part, double dt, const Vec3& tangent, const Vec3& axis, RodState& state) noexcept;

/// rad, of (cos, sin): Newton's method on the sine of the difference, whose error is cubed every time; no libm.
[[nodiscard]] double find_angle(double cosine, double sine) noexcept;

/// Energies from `first` on, and the first node that is not finite.
/// share    of the segment behind `first`, see inserted_share
void add_energies(const RodModel& model, const RodState& state, Index first, double share, const RodWorkspace& workspace,
                  RodReport& report) noexcept;

} // namespace trocar::fem
