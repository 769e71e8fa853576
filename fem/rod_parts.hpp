// Pieces of a rod's solve that all its integrators share. Internal to fem.
#pragma once

#include "fem/rod.hpp"

namespace seldinger::fem {

void size_workspace(std::size_t nodes, RodWorkspace& workspace);

/// Frames of where the rod is now turn its rest curvature into the world: workspace.axis, tangent, rest_bend.
void find_rest_bend(const RodModel& model, const RodState& state, const RodPort& port, RodWorkspace& workspace) noexcept;

/// Nodes before `first` to their places on the port's axis.
/// limits    the last of them is free to turn, so the rod is clamped half to one and a half segments behind the port: as a node
///           passes, the stiffness of 50 mm of rod with segments of 2 mm falls by 11 % at once
void move_behind_port(const RodModel& model, const RodPort& port, double insertion, double dt, Index first, RodState& state) noexcept;

/// Energies from `first` on, and the first node that is not finite.
void add_energies(const RodModel& model, const RodState& state, Index first, const RodWorkspace& workspace, RodReport& report) noexcept;

} // namespace seldinger::fem
