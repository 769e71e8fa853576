// Names, reports and the repairs that examine only ids and single triangles. Holes, shells and crossings have their own files.
#include "base/repair.hpp"

#include "base/predicates.hpp"
#include "base/repair_steps.hpp"
#include "base/topology.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace trocar {
namespace {

constexpr std::array<std::string_view, kRepairCount> kNames{
    "weld",   "drop_degenerate",   "drop_duplicates", "drop_non_manifold",      "fill_holes",
    "orient", "drop_inner_shells", "keep_largest",    "drop_self_intersections"};

/// Share of the longest box edge within which vertices are the same when no tolerance is given: what single-precision files
/// lose between two copies of a vertex, and far below any triangle of a scan.
constexpr double kDefaultWeld = 1e-6;

Result<void> check_usable(const TriMesh& mesh) {
    const auto bad = [](const std::string& why) { return Error{ErrorCode::BadMesh, "no repair works on this surface: " + why}; };
    if (mesh.triangles.empty()) return bad("it has no triangles");
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        for (const Index v : mesh.triangles[t]) {
            if (v >= mesh.vertices.size())
                return bad("triangle " + std::to_string(t) + " names vertex " + std::to_string(v) + " of " +
                           std::to_string(mesh.vertices.size()));
            if (!is_finite(mesh.vertices[v])) return bad("vertex " + std::to_string(v) + " is not finite");
        }
    return {};
}

} // namespace

std::string_view repair_name(Repair repair) noexcept { return kNames[static_cast<std::size_t>(repair)]; }

std::optional<Repair> find_repair(std::string_view name) noexcept {
    const auto found = std::find(kNames.begin(), kNames.end(), name);
    if (found == kNames.end()) return std::nullopt;
    return static_cast<Repair>(found - kNames.begin());
}

std::span<const std::string_view> repair_names() noexcept { return kNames; }

std::string RepairStep::to_string() const {
    std::string text;
    const auto add = [&text](std::size_t count, const char* what) {
        if (count > 0) text += (text.empty() ? "" : ", ") + std::to_string(count) + " " + what;
    };
    add(vertices_merged, "vertices merged");
    add(vertices_split, "vertices split");
    add(triangles_removed, "triangles removed");
    add(triangles_added, "triangles added");
    add(triangles_flipped, "triangles flipped");
    add(holes_filled, "holes filled");
    add(shells_removed, "shells removed");
    add(crossings_made, "pairs of triangles now cross");
    return std::string(repair_name(repair)) + ": " + (text.empty() ? "nothing to do" : text) + "; " + describe_change(before, after);
}

Result<RepairStep> apply_repair(TriMesh& mesh, Repair repair, const RepairOptions& options) {
    if (const Result<void> check = check_usable(mesh); !check) return check.error();
    TriMesh work = mesh;
    Result<RepairStep> step = [&]() -> Result<RepairStep> {
        switch (repair) {
        case Repair::Weld: {
            const double tolerance = options.weld_tolerance;
            return repairs::weld(work, tolerance > 0.0 ? tolerance : kDefaultWeld * work.bounds().longest_edge());
        }
        case Repair::DropDegenerate:
            return repairs::drop_degenerate(work);
        case Repair::DropDuplicates:
            return repairs::drop_duplicates(work);
        case Repair::DropNonManifold:
            return repairs::drop_non_manifold(work);
        case Repair::FillHoles:
            return repairs::fill_holes(work);
        case Repair::Orient:
            return repairs::orient(work);
        case Repair::DropInnerShells:
            return repairs::drop_inner_shells(work);
        case Repair::KeepLargest:
            return repairs::keep_largest(work);
        case Repair::DropSelfIntersections:
            return repairs::drop_self_intersections(work, options.most_rounds);
        }
        return Error{ErrorCode::BadValue, "no such repair"};
    }();
    if (!step) return Error{step.error().code, std::string(repair_name(repair)) + ": " + step.error().message};
    step->repair = repair;
    drop_unreferenced_vertices(work);
    step->before = measure_surface(mesh);
    step->after = measure_surface(work);
    if (const Result<void> allowed = repairs::check_removal(*step, options); !allowed) return allowed.error();
    mesh = std::move(work);
    return step;
}

Result<RepairReport> apply_repairs(TriMesh& mesh, std::span<const Repair> repairs, const RepairOptions& options) {
    TriMesh work = mesh;
    RepairReport report;
    for (const Repair repair : repairs) {
        Result<RepairStep> step = apply_repair(work, repair, options);
        if (!step) return step.error();
        report.steps.push_back(*step);
    }
    mesh = std::move(work);
    return report;
}

namespace repairs {

double area(const TriMesh& mesh, const Triangle& t) noexcept {
    const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
    return 0.5 * (b - a).cross(c - a).norm();
}

std::size_t keep_triangles(TriMesh& mesh, const std::vector<bool>& keep) {
    std::size_t kept = 0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        if (keep[t]) mesh.triangles[kept++] = mesh.triangles[t];
    const std::size_t removed = mesh.triangles.size() - kept;
    mesh.triangles.resize(kept);
    return removed;
}

std::size_t split_vertices(TriMesh& mesh, const std::vector<bool>& split, bool across_manifold_only) {
    const std::size_t count = mesh.vertices.size();
    const auto fans = corner_fans(mesh.triangles, count, across_manifold_only);
    std::vector<Index> extra(count, 0), first_copy(count, 0); // copies beside the vertex itself, which fan 0 keeps
    for (std::size_t t = 0; t < fans.size(); ++t)
        for (std::size_t k = 0; k < 3; ++k) extra[mesh.triangles[t][k]] = std::max(extra[mesh.triangles[t][k]], fans[t][k]);
    for (std::size_t v = 0; v < count; ++v) {
        if (!split[v]) continue;
        first_copy[v] = static_cast<Index>(mesh.vertices.size());
        mesh.vertices.insert(mesh.vertices.end(), extra[v], Vec3(mesh.vertices[v]));
    }
    for (std::size_t t = 0; t < fans.size(); ++t)
        for (std::size_t k = 0; k < 3; ++k) {
            Index& v = mesh.triangles[t][k];
            if (split[v] && fans[t][k] > 0) v = first_copy[v] + fans[t][k] - 1;
        }
    return mesh.vertices.size() - count;
}

Result<void> check_edge_manifold(const TriMesh& mesh, Repair asked) {
    const auto bad = [&](Index triangle, const char* why, Repair help) {
        return Error{ErrorCode::BadMesh, "triangle " + std::to_string(triangle) + " " + why + "; the repair " +
                                             std::string(repair_name(help)) + " before " + std::string(repair_name(asked)) + " helps"};
    };
    std::optional<Error> error;
    for (Index t = 0; t < mesh.triangles.size(); ++t) {
        const Triangle& v = mesh.triangles[t];
        if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0]) return bad(t, "repeats a vertex", Repair::DropDegenerate);
    }
    for_each_edge(sorted_edge_uses(mesh.triangles), [&](std::span<const EdgeUse> edge) {
        if (edge.size() > 2 && !error) error = bad(edge[2].triangle, "is the third at one edge", Repair::DropNonManifold);
    });
    if (error) return *error;
    return {};
}

/// Each vertex goes to the lowest earlier one within the tolerance that has itself stayed. Cells of the tolerance's size,
/// sorted, find the candidates: a cell lists the vertices that stayed, few since they are farther apart than the tolerance.
Result<RepairStep> weld(TriMesh& mesh, double tolerance) {
    using Cell = std::array<long long, 3>;
    const Box3 box = mesh.bounds();
    const double size = std::max(tolerance, 1e-15 * box.longest_edge());
    if (!(size > 0.0)) return Error{ErrorCode::BadMesh, "all vertices are one point"};
    std::vector<bool> used(mesh.vertices.size(), false);
    for (const Triangle& t : mesh.triangles)
        for (const Index v : t) used[v] = true;
    const auto cell_of = [&](Index v) -> Cell {
        const Vec3 cell = (mesh.vertices[v] - box.lo) / size;
        return {std::llround(cell[0]), std::llround(cell[1]), std::llround(cell[2])};
    };
    std::vector<Cell> cells; // ascending
    for (Index v = 0; v < mesh.vertices.size(); ++v)
        if (used[v]) cells.push_back(cell_of(v));
    std::sort(cells.begin(), cells.end());
    cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
    std::vector<Index> target(mesh.vertices.size(), kNoIndex);
    std::vector<Index> newest(cells.size(), kNoIndex);        // [cell] vertex that stayed last
    std::vector<Index> before(mesh.vertices.size(), kNoIndex); // [vertex] the one that stayed before it in its cell
    RepairStep step;
    for (Index v = 0; v < mesh.vertices.size(); ++v) {
        if (!used[v]) continue;
        const Cell at = cell_of(v);
        Index best = v;
        for (long long dx = -1; dx <= 1; ++dx)
            for (long long dy = -1; dy <= 1; ++dy) {
                const Cell low{at[0] + dx, at[1] + dy, at[2] - 1}, high{at[0] + dx, at[1] + dy, at[2] + 1};
                for (auto it = std::lower_bound(cells.begin(), cells.end(), low); it != cells.end() && *it <= high; ++it)
                    for (Index kept = newest[static_cast<std::size_t>(it - cells.begin())]; kept != kNoIndex; kept = before[kept])
                        if (kept < best && (mesh.vertices[kept] - mesh.vertices[v]).norm() <= tolerance) best = kept;
            }
        target[v] = best;
        if (best != v) {
            ++step.vertices_merged;
            continue;
        }
        const auto own = static_cast<std::size_t>(std::lower_bound(cells.begin(), cells.end(), at) - cells.begin());
        before[v] = std::exchange(newest[own], v);
    }
    std::vector<bool> keep(mesh.triangles.size(), true);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        Triangle& v = mesh.triangles[t];
        for (Index& corner : v) corner = target[corner];
        keep[t] = v[0] != v[1] && v[1] != v[2] && v[2] != v[0];
    }
    step.triangles_removed = keep_triangles(mesh, keep);
    return step;
}

Result<RepairStep> drop_duplicates(TriMesh& mesh) {
    std::vector<std::pair<Triangle, Index>> keys(mesh.triangles.size());
    for (Index t = 0; t < keys.size(); ++t) {
        keys[t] = {mesh.triangles[t], t};
        std::sort(keys[t].first.begin(), keys[t].first.end());
    }
    std::sort(keys.begin(), keys.end());
    std::vector<bool> keep(keys.size(), true);
    for (std::size_t i = 1; i < keys.size(); ++i)
        if (keys[i].first == keys[i - 1].first) keep[keys[i].second] = false;
    RepairStep step;
    step.triangles_removed = keep_triangles(mesh, keep);
    return step;
}

Result<RepairStep> drop_non_manifold(TriMesh& mesh) {
    RepairStep step;
    step.vertices_split = split_vertices(mesh, std::vector<bool>(mesh.vertices.size(), true), true);
    return step;
}

Result<RepairStep> keep_largest(TriMesh& mesh) {
    const Components parts = find_components(mesh.triangles, mesh.vertices.size());
    std::vector<double> areas(parts.count, 0.0);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) areas[parts.of_triangle[t]] += area(mesh, mesh.triangles[t]);
    const auto largest = static_cast<Index>(std::max_element(areas.begin(), areas.end()) - areas.begin());
    std::vector<bool> keep(mesh.triangles.size());
    for (std::size_t t = 0; t < keep.size(); ++t) keep[t] = parts.of_triangle[t] == largest;
    RepairStep step;
    step.triangles_removed = keep_triangles(mesh, keep);
    step.shells_removed = parts.count - 1;
    return step;
}

} // namespace repairs
} // namespace trocar
