#include "engine/prepare/way_shape.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace trocar::engine {

namespace {

/// Radii of the lumen, before and behind a place, over which the way's turn is measured.
constexpr double kTurnSpan = 3.0;

/// The first point that lies `span` m or more from point `from` along the way, ahead or behind; else its end.
std::size_t point_away(std::span<const Vec3> points, std::size_t from, double span, bool ahead) noexcept {
    std::size_t to = from;
    for (double along = 0.0; along < span && (ahead ? to + 1 < points.size() : to > 0);) {
        const std::size_t next = ahead ? to + 1 : to - 1;
        along += std::sqrt((points[next] - points[to]).squaredNorm());
        to = next;
    }
    return to;
}

} // namespace

WayPlace measure_place(std::span<const Vec3> points, std::span<const double> radii, std::size_t at) noexcept {
    const double span = kTurnSpan * radii[at];
    const std::size_t before = point_away(points, at, span, false), behind = point_away(points, at, span, true);
    const Vec3 in = points[at] - points[before], out = points[behind] - points[at];
    const auto near = radii.subspan(before, behind - before + 1);
    const auto [narrowest, widest] = std::minmax_element(near.begin(), near.end());
    return {std::atan2(std::sqrt(in.cross(out).squaredNorm()), in.dot(out)), *narrowest, *widest};
}

double tip_reach(double length, double angle) noexcept {
    if (!(angle > 0.0)) return 0.0;
    return length * (1.0 - std::cos(std::min(angle, std::numbers::pi))) / angle;
}

} // namespace trocar::engine
