// A vessel's surface becomes an anatomy that a scene can be made of: mended, its ends named by size, its middle as a tree, a place and a
// direction to enter by, targets, and an instrument that fits.
#pragma once

#include "engine/importing/imported_vessel.hpp"
#include "engine/importing/mend_vessel.hpp"

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace trocar::engine {

struct VesselOptions {
    MendMode mode = MendMode::Automatic;
    std::optional<Vec3> inlet;       // m, near the end that instruments enter by; none: the widest one
    std::string device;              // of the catalogue, the instrument; empty: a catheter made for the way
    std::vector<VesselEnd> openings; // known from elsewhere, of a surface that is closed already
};

/// raw       m, welded
/// progress  told what is being done
/// fails     BadMesh, BadValue: what is wrong, and the option that helps
[[nodiscard]] Result<ImportedVessel> import_vessel(TriMesh raw, const VesselOptions& options,
                                                   const std::function<void(const std::string&)>& progress = {});

} // namespace trocar::engine
