// The area of a surface.
#pragma once

#include "base/mesh.hpp"

namespace trocar {

/// Of all triangles together, in the unit of the coordinates, squared.
[[nodiscard]] inline double surface_area(const TriMesh& surface) noexcept {
    double area = 0.0;
    for (const Triangle& t : surface.triangles) {
        const Vec3& a = surface.vertices[t[0]];
        area += 0.5 * (surface.vertices[t[1]] - a).cross(surface.vertices[t[2]] - a).norm();
    }
    return area;
}

} // namespace trocar
