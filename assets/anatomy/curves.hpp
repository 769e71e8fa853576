// Smooth vessel axes through way points.
#pragma once

#include "base/vec.hpp"

#include <span>
#include <vector>

namespace trocar::anatomy {

/// Natural cubic spline through the way points (parameter: chord length), sampled about every `spacing`. C2.
/// points  at least 2, neighbours apart
[[nodiscard]] std::vector<Vec3> smooth_curve(std::span<const Vec3> points, double spacing);

/// The same polyline with samples `spacing` apart (evened out so that both ends stay).
[[nodiscard]] std::vector<Vec3> resample(std::span<const Vec3> points, double spacing);

/// Flattens every bend sharper than `radius` by diffusion; the first `fixed_first` and the last two points stay.
void relax_bends(std::vector<Vec3>& points, double radius, std::size_t fixed_first);

/// Arc length from the first point, [point_count].
[[nodiscard]] std::vector<double> arc_lengths(std::span<const Vec3> points);

/// m, radius of the circle through a point and its neighbours `window` of arc length away on both sides; infinite at the ends.
[[nodiscard]] std::vector<double> curvature_radii(std::span<const Vec3> points, double window);

/// Index of the nearest sample; the lowest on ties.
[[nodiscard]] std::size_t nearest_sample(std::span<const Vec3> points, const Vec3& p);

/// Unit tangent by central difference.
[[nodiscard]] Vec3 tangent(std::span<const Vec3> points, std::size_t i);

} // namespace trocar::anatomy
