// An imported vessel: surface, ends, centreline, places to enter by and to go to, an instrument that fits.
#pragma once

#include "base/mesh.hpp"
#include "engine/importing/centreline_branches.hpp"
#include "engine/importing/openings.hpp"

#include <string>
#include <vector>

namespace trocar::engine {

struct VesselTarget {
    std::string name;             // of the outlet
    Vec3 position = Vec3::Zero(); // m, in the middle, far enough from the end for its radius
    double radius = 0.0;          // m, of the lumen there
    double narrowest = 0.0;       // m, radius of the lumen at the narrowest place on the way
    double way = 0.0;             // m, from the entry
};

/// A catheter that fits the ways, or a device of the catalogue.
struct FittingInstrument {
    std::string device; // whose stiffness, radius and tip it has; empty: a catheter made for the way
    double radius = 0.0, segment = 0.0, tip_length = 0.0, length = 0.0; // m
    double tip_angle = 0.0;                                             // rad
    double speed = 0.0;                                                 // m/s, that it is driven at
    double inserted = 0.0;                                              // m, that is straight and free beyond the entry
    double tolerance = 0.0;                                             // m, to the target that it follows
    std::size_t target = 0;                                             // of the anatomy's, that it follows: the one with the widest way that does not turn back
};

struct ImportedVessel {
    TriMesh surface;                        // m; closed, manifold, outward, without crossings
    std::vector<std::string> repairs;       // with counts, in their order
    std::vector<std::string> notes;         // what the user may want to know
    bool was_sound = false;                 // no repair touched the surface
    std::vector<CentrelineBranch> branches; // [branch id]
    std::vector<VesselEnd> ends;            // [0] the inlet, then the outlets, widest first
    std::vector<Index> end_branch;          // [end] that ends there; of the inlet the one that begins there
    std::vector<VesselTarget> targets;      // [outlet]
    Vec3 entry = Vec3::Zero(), direction = Vec3::UnitZ(); // m, unit
    FittingInstrument instrument;
};

} // namespace trocar::engine
