#include "engine/importing/sweep_curves.hpp"

#include "assets/anatomy/curves.hpp"
#include "assets/anatomy/polygonise.hpp"
#include "assets/anatomy/remesh.hpp"
#include "assets/anatomy/vessel_field.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace trocar::engine {

namespace {

/// Of the smallest radius: the grid's cells; of a cell: the smallest radius that it still shows.
constexpr double kCellShare = 0.4, kShown = 1.25;
/// Cells that the surface may pass, about: a hundred bytes and some microseconds for each.
constexpr double kMostSurfaceCells = 4e5;
/// Cells of the whole box: polygonise evaluates the field in every block of 512, near the surface or not.
constexpr double kMostBoxCells = 2.5e10;
/// m, between the curves' walls and the sides of the box, as VesselField has it.
constexpr double kBoxMargin = 0.006;
/// Of a curve's radius: the fillet where it meets another.
constexpr double kBlendShare = 0.5;
constexpr double kLargestSpan = 3.0;     // m
constexpr double kSmallestRadius = 5e-5; // m
constexpr double kSpacingShare = 0.4;    // of the smallest radius of a curve, between its samples

Error bad_curve(const NamedCurve& curve, std::string why) { return {ErrorCode::BadValue, fmt::format("curve '{}' {}", curve.name, why)}; }

/// Without points that coincide.
Result<NamedCurve> clean(const NamedCurve& curve) {
    NamedCurve kept{curve.name, {}, {}};
    for (std::size_t i = 0; i < curve.points.size(); ++i) {
        if (!is_finite(curve.points[i]) || !(curve.radii[i] < 1.0)) return bad_curve(curve, fmt::format("has a point or a radius at {} that is no place of a vessel", i));
        if (!(curve.radii[i] >= kSmallestRadius))
            return bad_curve(curve, fmt::format("has the radius {:.4g} mm at point {}; expected {:g} mm or more", 1e3 * curve.radii[i], i, 1e3 * kSmallestRadius));
        if (!kept.points.empty() && (kept.points.back() - curve.points[i]).norm() < 0.1 * kSmallestRadius) continue;
        kept.points.push_back(curve.points[i]);
        kept.radii.push_back(curve.radii[i]);
    }
    if (kept.points.size() < 2) return bad_curve(curve, "has all its points in one place");
    return kept;
}

double area_of(const std::vector<NamedCurve>& curves) {
    double area = 0.0;
    for (const NamedCurve& curve : curves)
        for (std::size_t i = 1; i < curve.points.size(); ++i)
            area += std::numbers::pi * (curve.radii[i] + curve.radii[i - 1]) * (curve.points[i] - curve.points[i - 1]).norm();
    return area;
}

/// Fine enough for the smallest radius, unless that is beyond the bounds above.
double cell_for(const std::vector<NamedCurve>& curves, const Box3& box, double area) {
    double smallest = 1.0, largest = 0.0; // m
    for (const NamedCurve& curve : curves)
        for (const double radius : curve.radii) smallest = std::min(smallest, radius), largest = std::max(largest, radius);
    double cell = std::max(kCellShare * smallest, std::sqrt(area / kMostSurfaceCells));
    const Vec3 side = box.extent() + Vec3::Constant(2.0 * (largest + kBoxMargin));
    while ((side / cell).prod() > kMostBoxCells) cell *= 1.1;
    return cell;
}

anatomy::Tube make_tube_of_curve(const NamedCurve& curve, double cell) {
    anatomy::Tube tube;
    const double smallest = *std::min_element(curve.radii.begin(), curve.radii.end());
    tube.points = anatomy::resample(curve.points, std::max(kSpacingShare * smallest, 0.5 * cell));
    const std::vector<double> knots = anatomy::arc_lengths(curve.points), along = anatomy::arc_lengths(tube.points);
    std::size_t i = 0;
    for (const double s : along) {
        const double at = s / along.back() * knots.back();
        while (i + 2 < knots.size() && knots[i + 1] <= at) ++i;
        const double t = std::clamp((at - knots[i]) / (knots[i + 1] - knots[i]), 0.0, 1.0);
        tube.radii.push_back((1 - t) * curve.radii[i] + t * curve.radii[i + 1]);
    }
    tube.blend = kBlendShare * smallest;
    tube.blend_begin = tube.blend_end = 2.0 * along.back() + 1.0; // never fades
    return tube;
}

} // namespace

Result<SweptSurface> sweep_curves(const std::vector<NamedCurve>& curves) {
    std::vector<NamedCurve> cleaned;
    Box3 box;
    for (const NamedCurve& curve : curves) {
        Result<NamedCurve> good = clean(curve);
        if (!good.ok()) return good.error();
        for (const Vec3& p : good->points) box.add(p);
        cleaned.push_back(std::move(*good));
    }
    if (!(box.longest_edge() <= kLargestSpan))
        return Error{ErrorCode::BadValue, fmt::format("the curves span {:.4g} m; expected {:g} m or less: is the unit right?", box.longest_edge(), kLargestSpan)};
    SweptSurface swept;
    const double area = area_of(cleaned), cell = cell_for(cleaned, box, area);
    std::size_t raised = 0;
    for (NamedCurve& curve : cleaned)
        for (double& radius : curve.radii)
            if (radius < kShown * cell) radius = kShown * cell, ++raised;
    swept.told.push_back(fmt::format("swept: {} curves, found in cells of {:.3g} mm", cleaned.size(), 1e3 * cell));
    if (raised > 0) swept.told.push_back(fmt::format("radii: {} smaller than {:.3g} mm widened to that", raised, 1e3 * kShown * cell));
    std::vector<anatomy::Tube> tubes;
    for (const NamedCurve& curve : cleaned) tubes.push_back(make_tube_of_curve(curve, cell));
    const anatomy::VesselField field(std::move(tubes));
    const TriMesh cut = anatomy::polygonise(field, field.box(), cell, 1.3);
    const auto size = [&](const Vec3& p) { return std::sqrt(field.local_radius(p)); };
    const auto triangles = static_cast<std::size_t>(std::clamp(area / (cell * cell), 4000.0, 60000.0));
    swept.mesh = anatomy::remesh(cut, field, size, {triangles, 6});
    return swept;
}

} // namespace trocar::engine
