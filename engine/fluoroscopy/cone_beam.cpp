#include "engine/fluoroscopy/cone_beam.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::engine {

XrayProjection ConeBeam::projection() const noexcept {
    XrayProjection p;
    const double fu = sid / pitch[0], fv = sid / pitch[1];
    const Vec3 u = fu * right + 0.5 * pixels[0] * along, v = fv * down + 0.5 * pixels[1] * along;
    p.row(0) << u.transpose(), -u.dot(source);
    p.row(1) << v.transpose(), -v.dot(source);
    p.row(2) << along.transpose(), -along.dot(source);
    return p;
}

double ConeBeam::obliquity(double u, double v) const noexcept {
    const double x = (u - 0.5 * pixels[0]) * pitch[0] / sid, y = (v - 0.5 * pixels[1]) * pitch[1] / sid;
    return std::sqrt(1.0 + x * x + y * y);
}

ArmAngles find_angles(const XrayView& view, double time) noexcept {
    if (view.arm.empty()) return {view.primary, view.secondary};
    const auto after = std::upper_bound(view.arm.begin(), view.arm.end(), time, [](double t, const ArmRow& row) { return t < row.time; });
    if (after == view.arm.begin()) return {after->primary, after->secondary};
    const ArmRow& a = *std::prev(after);
    if (after == view.arm.end()) return {a.primary, a.secondary};
    const double w = (time - a.time) / (after->time - a.time);
    return {a.primary + w * (after->primary - a.primary), a.secondary + w * (after->secondary - a.secondary)};
}

ConeBeam make_cone_beam(const XrayView& view, const ArmAngles& angles) noexcept {
    const double sp = std::sin(angles.primary), cp = std::cos(angles.primary);
    const double ss = std::sin(angles.secondary), cs = std::cos(angles.secondary);
    const Vec3 across(-sp, cp, 0.0); // from the isocentre to the detector at secondary 0: anterior, + to the patient's left (-x)
    ConeBeam beam;
    beam.along = cs * across + ss * Vec3::UnitZ();
    beam.right = Vec3(-cp, -sp, 0.0);
    beam.down = ss * across - cs * Vec3::UnitZ();
    beam.source = view.isocentre - view.table - view.sod * beam.along;
    beam.sid = view.sid;
    beam.pixels = view.pixels;
    for (std::size_t k = 0; k < 2; ++k) beam.pitch[k] = view.detector[k] / view.pixels[k];
    return beam;
}

std::optional<std::array<double, 2>> project(const XrayProjection& projection, const Vec3& point) noexcept {
    const Vec3 p = projection * Eigen::Vector4d(point.x(), point.y(), point.z(), 1.0);
    if (!(p.z() > 0.0)) return std::nullopt;
    return std::array{p.x() / p.z(), p.y() / p.z()};
}

} // namespace trocar::engine
