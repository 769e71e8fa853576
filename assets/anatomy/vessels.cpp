#include "assets/anatomy/vessels.hpp"

#include "assets/anatomy/curves.hpp"
#include "assets/anatomy/polygonise.hpp"
#include "assets/anatomy/remesh.hpp"
#include "assets/anatomy/vessel_field.hpp"
#include "base/box.hpp"
#include "base/topology.hpp"

#include <algorithm>
#include <cmath>
#include <string>

namespace trocar::anatomy {

namespace {

/// Of the smallest radius: the grid that finds the surface, and the axis' samples.
constexpr double kCellShare = 0.4, kSpacingShare = 0.5;
/// Most the blended field changes per metre: blends and tapers add to a distance's 1.
constexpr double kSteepness = 1.3;
/// Cells of the grid at most: about a gigabyte of samples.
constexpr double kMostCells = 1e8;

std::string number_of(std::size_t branch) { return "branch " + std::to_string(branch + 1); }

Result<void> check_branch(const VesselBranch& branch, std::size_t index) {
    if (branch.axis.size() < 2 || branch.axis.size() != branch.radii.size())
        return Error{ErrorCode::BadValue, number_of(index) + " needs at least two points, each with a radius"};
    for (std::size_t i = 0; i < branch.axis.size(); ++i) {
        if (!(branch.radii[i] > 0.0)) return Error{ErrorCode::BadValue, number_of(index) + " has a radius that is not above 0"};
        if (i > 0 && !((branch.axis[i] - branch.axis[i - 1]).norm() > 1e-9))
            return Error{ErrorCode::BadValue, number_of(index) + " has the same point twice in a row"};
    }
    return {};
}

/// Radii at `points`, linear over the share of the arc between the way points.
std::vector<double> spread_radii(const VesselBranch& branch, std::span<const Vec3> points) {
    const std::vector<double> knots = arc_lengths(branch.axis), along = arc_lengths(points);
    std::vector<double> radii;
    std::size_t i = 0;
    for (const double s : along) {
        const double at = s / along.back() * knots.back();
        while (i + 2 < knots.size() && knots[i + 1] <= at) ++i;
        const double t = std::clamp((at - knots[i]) / (knots[i + 1] - knots[i]), 0.0, 1.0);
        radii.push_back((1 - t) * branch.radii[i] + t * branch.radii[i + 1]);
    }
    return radii;
}

Tube make_tube_of(const VesselBranch& branch, double spacing, double blend) {
    Tube tube;
    tube.points = smooth_curve(branch.axis, spacing);
    tube.radii = spread_radii(branch, tube.points);
    tube.blend = blend;
    tube.blend_begin = tube.blend_end = 2.0 * arc_lengths(tube.points).back() + 1.0; // never fades
    return tube;
}

} // namespace

Result<TriMesh> make_vessels(std::span<const VesselBranch> branches, double blend, std::size_t triangles) {
    if (branches.empty()) return Error{ErrorCode::BadValue, "vessels need at least one branch"};
    double smallest = branches.front().radii.empty() ? 0.0 : branches.front().radii.front();
    for (std::size_t k = 0; k < branches.size(); ++k) {
        if (const auto checked = check_branch(branches[k], k); !checked) return checked.error();
        smallest = std::min(smallest, *std::min_element(branches[k].radii.begin(), branches[k].radii.end()));
    }
    const double cell = kCellShare * smallest;
    Box3 bounds;
    for (const VesselBranch& branch : branches)
        for (std::size_t i = 0; i < branch.axis.size(); ++i)
            for (const double side : {-1.0, 1.0}) bounds.add(branch.axis[i] + side * Vec3::Constant(branch.radii[i]));
    const Vec3 cells = (bounds.hi - bounds.lo) / cell;
    if (!(cells.x() * cells.y() * cells.z() < kMostCells))
        return Error{ErrorCode::BadValue, "the vessels are too large for their smallest radius, " + std::to_string(1e3 * smallest) +
                                              " mm; expected a wider or a shorter tree"};
    std::vector<Tube> tubes;
    for (const VesselBranch& branch : branches) tubes.push_back(make_tube_of(branch, kSpacingShare * smallest, blend));
    const VesselField field(std::move(tubes));
    const auto size = [&](const Vec3& p) { return std::sqrt(field.local_radius(p)); };
    TriMesh mesh = remesh(polygonise(field, field.box(), cell, kSteepness), field, size, {triangles, 7});
    if (const std::size_t pieces = inspect_surface(mesh).components; pieces != 1)
        return Error{ErrorCode::BadMesh,
                     "the branches form " + std::to_string(pieces) + " separate pieces; expected branches that begin inside another"};
    return mesh;
}

} // namespace trocar::anatomy
