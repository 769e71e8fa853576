// Open ends of a vessel surface: border loops that cut a tube across, told from holes in its wall.
#pragma once

#include "base/mesh.hpp"

#include <string>
#include <vector>

namespace trocar::engine {

/// Where a vessel ends: a border loop of the surface, a cut by the side of an image, or a tip of the centreline.
struct VesselEnd {
    std::string name;             // inlet, outlet_1, outlet_2, ... by size
    Vec3 centre = Vec3::Zero();   // m
    Vec3 inward = Vec3::UnitZ();  // unit, into the lumen
    double radius = 0.0;          // m, of the disc of the same area; of a closed end that of the centreline
    bool open = true;             // it was open and has been capped; false: it ended closed
    bool dome = false;            // closed, and wider than the way to it: a sac
};

/// Loops of border edges that a capped surface ends in. A loop counts as an opening where the wall around it runs along its axis and
/// it is about flat; others are holes in the wall.
/// returns  in the order of their lowest vertex; `inward` may still point out of the lumen: see point_inward
[[nodiscard]] std::vector<VesselEnd> find_openings(const TriMesh& mesh);

/// Turns each end's axis into the closed surface that was made of the mesh, and drops ends that lie on no wall of it.
void point_inward(std::vector<VesselEnd>& ends, const TriMesh& closed);

} // namespace trocar::engine
