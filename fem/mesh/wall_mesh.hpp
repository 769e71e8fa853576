// The wall of a vessel as tetrahedra: layers of prisms on the outside of its lumen's surface.
#pragma once

#include "base/mesh.hpp"
#include "base/result.hpp"

namespace trocar::fem {

struct WallOptions {
    double thickness = 0.0; // m, > 0: across the triangles, where the surface's curvature leaves room for it
    Index layers = 1;       // > 0, through the thickness
};

struct WallMesh {
    TetMesh tets;              // nodes of the surface first, in its order, then layer by layer outwards; empty where it folds
    bool folds = false;        // still, where kLeastWall of the thickness is left
    std::size_t thinned = 0;   // vertices of the surface where the wall is thinner
    double least_share = 1.0;  // [-] of the thickness, where it is thinnest
    Index thinnest = kNoIndex; // vertex of the surface there
};

/// surface: closed, outward, without area 0. Where it is bent so sharply towards the outside that prisms would fold over, the wall is thinner there,
/// and changes its thickness gradually along edges. Fails with BadValue, or with BadMesh for a surface without triangles.
/// Parts of a wall that lie in one another, of branches side by side, are not looked for: they do not touch.
[[nodiscard]] Result<WallMesh> make_wall_mesh(const TriMesh& surface, const WallOptions& options);

inline constexpr double kLeastWall = 0.1; // [-] of the thickness asked for

} // namespace trocar::fem
