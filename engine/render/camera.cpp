#include "engine/render/camera.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace trocar::engine {
namespace {

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

[[nodiscard]] Camera fit_perspective(std::span<const Vec3> points, const Framing& framing, const ViewAxes& axes) {
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

[[nodiscard]] Camera fit_orthographic(std::span<const Vec3> points, const Framing& framing, const ViewAxes& axes) {
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

ViewAxes make_view_axes(const Vec3& direction, const Vec3& up) noexcept {
    ViewAxes axes;
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

Camera frame_camera(std::span<const Vec3> points, const Framing& framing) {
    const ViewAxes axes = make_view_axes(framing.direction, framing.up);
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

} // namespace trocar::engine
