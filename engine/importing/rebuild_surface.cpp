#include "engine/importing/rebuild_surface.hpp"

#include "assets/anatomy/polygonise.hpp"
#include "base/inside.hpp"
#include "base/repair.hpp"
#include "base/self_intersection.hpp"
#include "base/simplify.hpp"
#include "base/topology.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <vector>

namespace trocar::engine {

namespace {

/// Cells along the longest side of the surface's box, and at most so many in all.
constexpr double kCellsAlong = 320.0, kMostCells = 3e7;
/// Of a cell: how far the decimation may go.
constexpr double kDecimation = 0.2;

class WindingField final : public anatomy::Field {
public:
    explicit WindingField(const TriMesh& mesh) : inside_(mesh) {}
    [[nodiscard]] double value(const Vec3& p) const override { return inside_.signed_distance(p); }

private:
    InsideTest inside_;
};

/// What can be done without knowing what is inside; a step that does not work is left out.
TriMesh close_roughly(const TriMesh& raw) {
    TriMesh mesh = raw;
    RepairOptions options;
    options.may_remove = 1.0;
    options.may_split = true;
    for (const Repair repair :
         {Repair::Weld, Repair::DropDegenerate, Repair::DropDuplicates, Repair::DropNonManifold, Repair::FillHoles, Repair::Orient})
        (void)apply_repair(mesh, repair, options);
    return mesh;
}

double cell_for(const Box3& box) {
    double cell = box.longest_edge() / kCellsAlong;
    const Vec3 side = box.extent();
    while ((side.x() / cell + 4.0) * (side.y() / cell + 4.0) * (side.z() / cell + 4.0) > kMostCells) cell *= 1.1;
    return cell;
}

/// Proven.
bool crosses_nowhere(const TriMesh& mesh) {
    const SelfIntersections found = find_self_intersections(mesh, 1);
    return found.count == 0 && found.complete;
}

/// As few triangles as the bound on the error allows; where that folds the surface onto itself, what crosses is cut out and closed again.
/// none  it still crosses itself, or is no longer closed
std::optional<TriMesh> decimate(const TriMesh& cut, std::size_t triangles, double error) {
    Result<TriMesh> fewer = simplify(cut, triangles, {.max_error = error});
    if (!fewer.ok()) return std::nullopt;
    if (crosses_nowhere(*fewer)) return std::move(*fewer);
    const Result<RepairStep> mended = apply_repair(*fewer, Repair::DropSelfIntersections);
    if (!mended.ok() || !check_closed_surface(*fewer).ok() || !crosses_nowhere(*fewer)) return std::nullopt;
    return std::move(*fewer);
}

} // namespace

double largest_distance(const TriMesh& from, const TriMesh& to) {
    const TriangleTree tree(to);
    double most = 0.0;
    const auto look = [&](const Vec3& p) {
        if (const auto nearest = tree.closest(p)) most = std::max(most, nearest->distance);
    };
    std::vector<bool> looked(from.vertices.size(), false);
    for (const Triangle& t : from.triangles) {
        look((from.vertices[t[0]] + from.vertices[t[1]] + from.vertices[t[2]]) / 3.0);
        for (const Index v : t) {
            if (!looked[v]) look(from.vertices[v]);
            looked[v] = true;
        }
    }
    return most;
}

Result<RebuiltSurface> rebuild_surface(const TriMesh& raw) {
    const TriMesh closed = close_roughly(raw);
    const SurfaceReport report = inspect_surface(closed);
    if (!report.closed() || !report.oriented())
        return Error{ErrorCode::BadMesh, fmt::format("it cannot be made anew from what it encloses either: {} border edges are left",
                                                     report.boundary_edges)};
    Box3 box = closed.bounds();
    const double cell = cell_for(box);
    box.inflate(2.0 * cell);
    const TriMesh cut = anatomy::polygonise(WindingField(closed), box, cell, 1.0);
    if (cut.triangles.empty())
        return Error{ErrorCode::BadMesh,
                     fmt::format("it cannot be made anew from what it encloses either: nothing is wider than {:.3g} mm", 1e3 * cell)};
    TriMesh made = decimate(cut, std::max<std::size_t>(2000, raw.triangles.size()), kDecimation * cell).value_or(cut);
    std::string told = fmt::format("rebuild: made anew from what it encloses, in cells of {:.3g} mm, triangles {} to {}, at most {:.3g} mm from "
                                   "the old surface",
                                   1e3 * cell, raw.triangles.size(), made.triangles.size(), 1e3 * largest_distance(made, closed));
    return RebuiltSurface{std::move(made), std::move(told)};
}

} // namespace trocar::engine
