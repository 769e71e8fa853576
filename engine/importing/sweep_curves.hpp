// One closed surface round curves with radii: swept, and blended where they meet.
#pragma once

#include "engine/importing/curve_set.hpp"

namespace trocar::engine {

struct SweptSurface {
    TriMesh mesh;                   // m; closed, manifold, outward; more than one piece where curves do not meet
    std::vector<std::string> told;  // how fine, and which radii were too small for that
};

/// Radii too small for the cells that the surface's area and the curves' box allow are widened, and told.
/// fails  BadValue: a curve whose points coincide, a radius that is 0 or not finite, curves that span more than instruments reach
[[nodiscard]] Result<SweptSurface> sweep_curves(const std::vector<NamedCurve>& curves);

} // namespace trocar::engine
