// The surface of a mask: cut by marching tetrahedra, smoothed without loss of volume, with no more triangles than a stated error asks for.
#pragma once

#include "base/mesh.hpp"
#include "engine/importing/label_mask.hpp"

#include <functional>
#include <string>

namespace trocar::engine {

struct LabelSurfaceOptions {
    /// Of the smallest spacing: farthest that the decimation may lead from the surface, anywhere. It adds to what the voxels leave open: where a
    /// wall runs along a row of voxel centres, the surface lies up to 0.42 voxels from it. With 0.2 radii stay within half a voxel; with 0.4
    /// there are half as many triangles.
    double error = 0.2;
    int smoothing = 10; // rounds; 0: the voxels' stairs
};

struct LabelSurface {
    TriMesh mesh;               // m; closed, manifold, outward
    double volume = 0.0;        // m^3
    double mask_volume = 0.0;   // m^3, of the voxels
    double decimation = 0.0;    // m, largest distance between the surface before and after the decimation, either way
    double smoothing = 0.0;     // m, largest move of a vertex by the smoothing
    std::size_t cut = 0;        // triangles before the decimation

    [[nodiscard]] std::string told() const;
};

/// source   Taubin 1995, "A signal processing approach to fair surface design". Deviates: afterwards each vertex moves along its normal
///          until the volume is that of the voxels
[[nodiscard]] Result<LabelSurface> make_label_surface(const LabelMask& mask, const LabelSurfaceOptions& options,
                                                      const std::function<void(const std::string&)>& progress = {});

} // namespace trocar::engine
