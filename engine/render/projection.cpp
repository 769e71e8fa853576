#include "engine/render/projection.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::engine {

Projection make_projection(const Camera& camera, const Box3& bounds, int width, int height) noexcept {
    const ViewAxes axes = make_view_axes(camera.look_at - camera.eye, camera.up);
    Projection view;
    view.origin = bounds.empty() ? camera.look_at : bounds.centre();
    view.eye = camera.eye;
    view.right = axes.right;
    view.up = axes.up;
    view.forward = axes.forward;
    view.orthographic = camera.orthographic;
    view.half_height = camera.orthographic ? 0.5 * camera.height : std::tan(0.5 * camera.field_of_view_rad);
    view.width = width;
    view.height = height;

    // near and far planes around the bounding sphere: float depth is precise enough for it
    const double radius = bounds.empty() ? 1.0 : 0.5 * bounds.extent().norm() + 1e-6;
    const double centre = (view.origin - view.eye).dot(view.forward);
    const double far_plane = std::max(centre + radius, 1e-4);
    const double near_plane = view.orthographic ? centre - radius : std::max(centre - radius, 1e-3 * far_plane);

    const Vec3 offset = view.origin - view.eye;
    view.view_from_origin.setIdentity();
    view.view_from_origin.block<1, 3>(0, 0) = axes.right.transpose().cast<float>();
    view.view_from_origin.block<1, 3>(1, 0) = axes.up.transpose().cast<float>();
    view.view_from_origin.block<1, 3>(2, 0) = -axes.forward.transpose().cast<float>();
    view.view_from_origin(0, 3) = static_cast<float>(axes.right.dot(offset));
    view.view_from_origin(1, 3) = static_cast<float>(axes.up.dot(offset));
    view.view_from_origin(2, 3) = static_cast<float>(-axes.forward.dot(offset));

    const double aspect = static_cast<double>(width) / static_cast<double>(height);
    const double depth = far_plane - near_plane;
    view.clip_from_view.setZero();
    view.clip_from_view(0, 0) = static_cast<float>(1.0 / (view.half_height * aspect));
    view.clip_from_view(1, 1) = static_cast<float>(1.0 / view.half_height);
    if (view.orthographic) {
        view.clip_from_view(2, 2) = static_cast<float>(-1.0 / depth);
        view.clip_from_view(2, 3) = static_cast<float>(-near_plane / depth);
        view.clip_from_view(3, 3) = 1.0F;
    } else {
        view.clip_from_view(2, 2) = static_cast<float>(-far_plane / depth);
        view.clip_from_view(2, 3) = static_cast<float>(-far_plane * near_plane / depth);
        view.clip_from_view(3, 2) = -1.0F;
    }
    return view;
}

Vec3 Projection::to_pixel(const Vec3& point) const noexcept {
    const Vec3 offset = point - eye;
    const double along = offset.dot(forward);
    const double scale = 1.0 / (pixel_size(along));
    return {0.5 * width + offset.dot(right) * scale, 0.5 * height - offset.dot(up) * scale, along};
}

double Projection::pixel_size(double distance) const noexcept {
    return (orthographic ? 2.0 * half_height : 2.0 * half_height * distance) / height;
}

} // namespace trocar::engine
