// A vessel's surface as it came, made into a lumen: repairs are chosen by what is wrong, named, and counted. None is silent.
#pragma once

#include "base/mesh.hpp"
#include "base/result.hpp"
#include "engine/importing/openings.hpp"

#include <optional>
#include <string>
#include <vector>

namespace trocar::engine {

enum class MendMode : std::uint8_t {
    Automatic, // what the surface needs
    None,      // a surface that needs a repair is refused, as a scene refuses it
};

struct MendedVessel {
    TriMesh surface;                // m; closed, manifold, outward, without crossings, one shell
    std::vector<VesselEnd> openings; // of that shell; without names
    std::vector<std::string> repairs; // in their order, each with what it counted
    bool was_sound = false;         // nothing was done to the surface's own triangles
};

/// raw    m, welded; left as it is on an error
/// near   m; of several shells the one nearest to it is kept, without it the largest one
/// fails  BadMesh, with the repairs that were tried and the option that helps
[[nodiscard]] Result<MendedVessel> mend_vessel(TriMesh raw, MendMode mode, const std::optional<Vec3>& near);

/// The same for a solid organ: of a double wall the outer side stays, crossings are left to the scene, holes are no openings.
[[nodiscard]] Result<MendedVessel> mend_organ(TriMesh raw, MendMode mode);

} // namespace trocar::engine
