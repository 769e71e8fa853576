// Private to engine/render: a camera as matrices, and points as pixels.
#pragma once

#include "engine/render/camera.hpp"

#include <Eigen/Core>

namespace trocar::engine {

using Mat4f = Eigen::Matrix4f;

/// Built for one picture. Vertices travel to the GPU as floats relative to `origin`.
struct Projection {
    Vec3 origin = Vec3::Zero(); // m, world point that float coordinates are relative to
    Vec3 eye = Vec3::Zero();    // m
    Vec3 right = Vec3::UnitX(); // unit axes of the view, world
    Vec3 up = Vec3::UnitY();
    Vec3 forward = -Vec3::UnitZ();
    double half_height = 1.0; // perspective: tangent of half the opening angle; orthographic: half the height, m
    bool orthographic = false;
    int width = 1; // pixels
    int height = 1;
    Mat4f view_from_origin; // column-major, float
    Mat4f clip_from_view;   // depth 0 at the near plane, 1 at the far plane

    /// x, y in pixels from the top left corner of the picture; z is the distance along the view, m.
    [[nodiscard]] Vec3 to_pixel(const Vec3& point) const noexcept;
    /// Metres per pixel at a distance along the view.
    [[nodiscard]] double pixel_size(double distance) const noexcept;
};

/// bounds  what will be drawn: sets the origin and the near and far planes
[[nodiscard]] Projection make_projection(const Camera& camera, const Box3& bounds, int width, int height) noexcept;

} // namespace trocar::engine
