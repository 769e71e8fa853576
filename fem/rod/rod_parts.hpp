// Parts of a rod's solve that all its integrators share. Internal to fem.
#pragma once

#include "fem/rod/rod.hpp"

namespace trocar::fem {

void size_workspace(std::size_t nodes, RodWorkspace& workspace);

/// Frames of the current configuration rotate its rest curvature into the world: workspace.axis, tangent, rest_bend.
void find_rest_bend(const RodModel& model, const RodState& state, const RodPort& port, RodWorkspace& workspace) noexcept;

/// How much of the segment behind node `first` has passed the port, [-] of its length, at least a fiftieth: that much of it
/// bends, twists and stretches. So what is clamped half a segment behind the port stays there, and a node comes in as stiff
/// as it stood before the port. The rest keeps the stiffness finite, at a jump of a quarter of a per cent in 25 segments.
[[nodiscard]] double inserted_share(const RodModel& model, double insertion, Index first) noexcept;

/// Nodes before `first` to their places on the port's axis.
void move_behind_port(const RodModel& model, const RodPort& port, double insertion, double dt, Index first, RodState& state) noexcept;

/// Energies from `first` on, and the first node that is not finite.
/// share    of the segment behind `first`, see inserted_share
void add_energies(const RodModel& model, const RodState& state, Index first, double share, const RodWorkspace& workspace,
                  RodReport& report) noexcept;

} // namespace trocar::fem
