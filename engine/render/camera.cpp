#include "engine/render/camera.hpp"
#include "engine/render/projection.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace trocar::engine {
namespace {

struct Axes {
    Vec3 right, up, forward;
};

// Never fails: directions without length, or an up along the view, are replaced by an axis that works.
[[nodiscard]] Axes make_axes(const Vec3& direction, const Vec3& up) noexcept {
    Axes axes;
    const double length = direction.norm();
    axes.forward = length > 0.0 && std::isfinite(length) ? Vec3(direction / length) : Vec3(0.0, -1.0, 0.0);
    axes.right = axes.forward.cross(up);
    if (!(axes.right.squaredNorm() > 1e-12 * up.squaredNorm())) {
        const Vec3 other = std::abs(axes.forward.z()) < 0.9 ? Vec3::UnitZ() : Vec3::UnitY();
        axes.right = axes.forward.cross(other);
    }
    axes.right.normalize();
    axes.up = axes.right.cross(axes.forward);
    return axes;
}

struct Interval {
    double lo = std::numeric_limits<double>::infinity();
    double hi = -std::numeric_limits<double>::infinity();
    void add(double value) noexcept {
        lo = std::min(lo, value);
        hi = std::max(hi, value);
    }
};

// A point p is inside the cone of slope s when |x| <= s * (distance along the view): p.x - s p.f bounds the eye from
// one side and p.x + s p.f from the other, so the closest eye follows from the extremes of both.
struct ConeFit {
    Interval minus, plus; // of  coordinate - slope * along  and  coordinate + slope * along
    void add(double coordinate, double along, double slope) noexcept {
        minus.add(coordinate - slope * along);
        plus.add(coordinate + slope * along);
    }
    [[nodiscard]] double centre() const noexcept { return 0.5 * (minus.hi + plus.lo); }
    [[nodiscard]] double back(double slope) const noexcept { return (minus.hi - plus.lo) / (2.0 * slope); } // eye at -back
};

[[nodiscard]] Camera fit_perspective(std::span<const Vec3> points, const Framing& framing, const Axes& axes) {
    const double slope_y = std::tan(0.5 * framing.field_of_view_rad) * (1.0 - 2.0 * framing.margin);
    const double slope_x = slope_y * framing.aspect;
    ConeFit x, y;
    Interval along;
    for (const Vec3& p : points) {
        if (!is_finite(p)) continue;
        const double f = p.dot(axes.forward);
        x.add(p.dot(axes.right), f, slope_x);
        y.add(p.dot(axes.up), f, slope_y);
        along.add(f);
    }
    const double extent = along.hi - along.lo;
    const double eye_along = std::min({-x.back(slope_x), -y.back(slope_y), along.lo - 1e-3 * extent - 1e-6});
    Camera camera;
    camera.eye = axes.right * x.centre() + axes.up * y.centre() + axes.forward * eye_along;
    camera.look_at = camera.eye + axes.forward * (0.5 * (along.lo + along.hi) - eye_along);
    return camera;
}

[[nodiscard]] Camera fit_orthographic(std::span<const Vec3> points, const Framing& framing, const Axes& axes) {
    Interval x, y, along;
    for (const Vec3& p : points) {
        if (!is_finite(p)) continue;
        x.add(p.dot(axes.right));
        y.add(p.dot(axes.up));
        along.add(p.dot(axes.forward));
    }
    Camera camera;
    const double usable = 1.0 - 2.0 * framing.margin;
    camera.height = std::max({(y.hi - y.lo) / usable, (x.hi - x.lo) / (usable * framing.aspect), 1e-6});
    const double depth = along.hi - along.lo + camera.height;
    camera.look_at = 0.5 * (axes.right * (x.lo + x.hi) + axes.up * (y.lo + y.hi) + axes.forward * (along.lo + along.hi));
    camera.eye = camera.look_at - axes.forward * depth;
    return camera;
}

} // namespace

Camera frame_camera(std::span<const Vec3> points, const Framing& framing) {
    const Axes axes = make_axes(framing.direction, framing.up);
    Camera camera;
    const bool anything = std::any_of(points.begin(), points.end(), [](const Vec3& p) { return is_finite(p); });
    if (!anything) {
        camera.eye = -axes.forward;
    } else {
        camera = framing.orthographic ? fit_orthographic(points, framing, axes) : fit_perspective(points, framing, axes);
    }
    camera.up = axes.up;
    camera.orthographic = framing.orthographic;
    camera.field_of_view_rad = framing.field_of_view_rad;
    return camera;
}

Camera frame_camera(const Box3& bounds, const Framing& framing) {
    if (bounds.empty()) return frame_camera(std::span<const Vec3>(), framing);
    std::array<Vec3, 8> corners;
    for (std::size_t i = 0; i < corners.size(); ++i)
        corners[i] = Vec3((i & 1) != 0 ? bounds.hi.x() : bounds.lo.x(), (i & 2) != 0 ? bounds.hi.y() : bounds.lo.y(),
                          (i & 4) != 0 ? bounds.hi.z() : bounds.lo.z());
    return frame_camera(corners, framing);
}

Projection make_projection(const Camera& camera, const Box3& bounds, int width, int height) noexcept {
    const Axes axes = make_axes(camera.look_at - camera.eye, camera.up);
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
