// What a rod carries inside: tension, bending moment and torque along it.
#pragma once

#include "fem/rod/rod_model.hpp"

#include <vector>

namespace trocar::fem {

/// At the end of a step. Segment i lies between nodes i and i + 1; what has not passed the port carries nothing.
struct RodInternalForces {
    std::vector<double> tension; // [node_count - 1] N of a segment, negative: pressed
    std::vector<Vec3> moment;    // [node_count] N m of bending at a node, about the axis it bends round; that of the rest shape is taken off
    std::vector<double> torque;  // [node_count - 1] N m about the rod's axis; 0 without torsion
};

/// O(nodes); allocates.
[[nodiscard]] RodInternalForces find_internal_forces(const RodModel& model, const RodState& state, const RodPort& port);

/// Largest share, [-], by which a segment beyond the port, or the one in it, is longer or shorter than at rest.
[[nodiscard]] double find_largest_stretch(const RodModel& model, const RodState& state) noexcept;

} // namespace trocar::fem
