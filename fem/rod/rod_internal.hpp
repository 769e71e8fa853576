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

/// How the rod was solved.
struct RodSolvedAs {
    bool clamped = false;     // a clamp holds the tip: it ends in the middle of the last segment, whose other half alone twists
    bool mass_spring = false; // a chain of masses and springs: what is in the port is as stiff as elsewhere
};

/// O(nodes); allocates.
[[nodiscard]] RodInternalForces find_internal_forces(const RodModel& model, const RodState& state, const RodPort& port, RodSolvedAs as = {});

/// Largest share, [-], by which a segment beyond the port, or the one in it, is longer or shorter than at rest.
[[nodiscard]] double find_largest_stretch(const RodModel& model, const RodState& state) noexcept;

} // namespace trocar::fem
