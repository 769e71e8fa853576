#include "engine/importing/mend_vessel.hpp"

#include "base/inside.hpp"
#include "base/repair.hpp"
#include "base/repair_steps.hpp"
#include "base/topology.hpp"
#include "engine/importing/rebuild_surface.hpp"
#include "engine/prepare/surface_rule.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace trocar::engine {

namespace {

/// Of the outer shell's volume: a shell inside that holds this much is the inner side of a wall, not a stone in a lumen.
constexpr double kInnerWall = 0.15;
/// Of the way to the middle of its neighbours, by which a copy of a vertex is moved.
constexpr double kApart = 1e-3;
/// Vertices of a shell that are tried for lying inside another.
constexpr std::size_t kNestingSamples = 32;

const SurfaceNeeds& lumen_needs() {
    static const SurfaceNeeds needs{"a lumen", true, true};
    return needs;
}

const SurfaceNeeds& organ_needs() {
    static const SurfaceNeeds needs{"an organ", true, false};
    return needs;
}

Result<void> check_numbers(const TriMesh& raw) {
    if (raw.triangles.empty()) return Error{ErrorCode::BadMesh, "the surface has no triangles"};
    const Box3 box = raw.bounds();
    if (box.longest_edge() > 0.0) return check_fans(raw);
    return Error{ErrorCode::BadMesh, "all its triangles lie in one point"};
}

/// The chain of repairs that mends all of it, applied.
Result<void> apply_proposed(TriMesh& mesh, const SurfaceNeeds& needs, std::vector<std::string>& told) {
    const RepairAdvice advice = propose_repairs(mesh, {}, needs, {});
    if (!advice.proposal) return Error{ErrorCode::BadMesh, advice.obstacle};
    RepairOptions options;
    options.may_split = advice.proposal->splits;
    const Result<RepairReport> report = apply_repairs(mesh, advice.proposal->repairs, options);
    if (!report.ok()) return report.error();
    for (const RepairStep& step : report->steps) told.push_back(step.to_string());
    return {};
}

bool lies_in(const TriMesh& inner, const InsideTest& outer) {
    const std::size_t stride = std::max<std::size_t>(1, inner.vertices.size() / kNestingSamples);
    for (std::size_t v = 0; v < inner.vertices.size(); v += stride)
        if (!outer.inside(inner.vertices[v])) return false;
    return true;
}

std::size_t choose_shell(const std::vector<repairs::Part>& shells, const std::optional<Vec3>& near) {
    const auto score = [&](const repairs::Part& shell) {
        return near ? -TriangleTree(shell.mesh).closest(*near)->distance : std::abs(signed_volume(shell.mesh));
    };
    std::size_t best = 0;
    double most = score(shells[0]);
    for (std::size_t s = 1; s < shells.size(); ++s)
        if (const double value = score(shells[s]); value > most) most = value, best = s;
    return best;
}

/// One shell of several: of a double wall the inner one; the others are named and counted.
void keep_one_shell(MendedVessel& vessel, const std::optional<Vec3>& near) {
    std::vector<repairs::Part> shells = repairs::split_into_shells(vessel.surface);
    if (shells.size() < 2) return;
    std::size_t kept = choose_shell(shells, near), walls = 0;
    for (bool nested = true; nested;) {
        nested = false;
        const InsideTest outer(shells[kept].mesh);
        const double volume = std::abs(signed_volume(shells[kept].mesh));
        for (std::size_t s = 0; s < shells.size() && !nested; ++s) {
            const double inner = std::abs(signed_volume(shells[s].mesh));
            if (s == kept || inner < kInnerWall * volume || inner >= volume || !lies_in(shells[s].mesh, outer)) continue;
            kept = s, nested = true, ++walls;
        }
    }
    const double whole = measure_surface(vessel.surface).area;
    TriMesh& mesh = shells[kept].mesh;
    if (signed_volume(mesh) < 0.0)
        for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
    if (walls > 0) vessel.repairs.push_back(fmt::format("double_walls: {} outer shells removed, the inner one is the lumen", walls));
    if (const std::size_t islands = shells.size() - 1 - walls; islands > 0)
        vessel.repairs.push_back(fmt::format("islands: {} of {} shells removed, {:.1f} % of the area; --inlet x,y,z near another one keeps that",
                                             islands, shells.size(), 100.0 * (1.0 - measure_surface(mesh).area / whole)));
    vessel.surface = std::move(mesh);
}

/// Where a surface was cut at an edge of three triangles, copies of a vertex lie in one place, and a file's reader would join them again:
/// each goes a little way into the fan that it belongs to.
Result<void> part_equal_vertices(MendedVessel& vessel, const SurfaceNeeds& needs) {
    TriMesh& mesh = vessel.surface;
    std::vector<Index> order(mesh.vertices.size());
    for (Index v = 0; v < order.size(); ++v) order[v] = v;
    const auto before = [&](Index a, Index b) {
        const Vec3 &p = mesh.vertices[a], &q = mesh.vertices[b];
        return std::lexicographical_compare(p.begin(), p.end(), q.begin(), q.end());
    };
    std::stable_sort(order.begin(), order.end(), before);
    const VertexTriangles around = vertex_triangles(mesh.triangles, mesh.vertices.size());
    const std::vector<Vec3> old = mesh.vertices;
    std::size_t moved = 0;
    for (std::size_t i = 0; i < order.size(); ++i) {
        const bool as_last = i > 0 && old[order[i]] == old[order[i - 1]], as_next = i + 1 < order.size() && old[order[i]] == old[order[i + 1]];
        if (!as_last && !as_next) continue;
        Vec3 middle = Vec3::Zero();
        double count = 0.0;
        for (const Index t : around.of(order[i]))
            for (const Index v : mesh.triangles[t]) middle += old[v], count += 1.0;
        mesh.vertices[order[i]] += kApart * (middle / count - old[order[i]]);
        ++moved;
    }
    if (moved == 0) return {};
    vessel.repairs.push_back(fmt::format("part: {} vertices that lay in one place with others moved apart, by {:g} of the way to their neighbours",
                                         moved, kApart));
    if (const auto defect = find_defect(mesh, inspect_surface(mesh), needs))
        return Error{ErrorCode::BadMesh, "after all repairs " + defect->what};
    return {};
}

/// Repairs, or a surface made anew, until nothing is wrong for the use.
Result<void> mend(MendedVessel& vessel, MendMode mode, const SurfaceNeeds& needs) {
    const auto defect = find_defect(vessel.surface, inspect_surface(vessel.surface), needs);
    if (!defect) return {};
    if (!defect->repair) return Error{ErrorCode::BadMesh, defect->what};
    if (mode == MendMode::None) return Error{ErrorCode::BadMesh, defect->what + "; without --repair none it is mended, and each repair is named"};
    vessel.was_sound = false;
    TriMesh mended = vessel.surface;
    const Result<void> proposed = apply_proposed(mended, needs, vessel.repairs);
    if (!proposed.ok()) {
        Result<RebuiltSurface> rebuilt = rebuild_surface(vessel.surface);
        if (!rebuilt.ok())
            return Error{ErrorCode::BadMesh, defect->what + "; no chain of repairs mends it: " + proposed.error().message + "; " + rebuilt.error().message};
        vessel.repairs = {fmt::format("no chain of repairs mends it: {}", proposed.error().message), rebuilt->told};
        mended = std::move(rebuilt->surface);
    }
    vessel.surface = std::move(mended);
    return {};
}

} // namespace

Result<MendedVessel> mend_vessel(TriMesh raw, MendMode mode, const std::optional<Vec3>& near) {
    if (const Result<void> usable = check_numbers(raw); !usable.ok()) return usable.error();
    drop_unreferenced_vertices(raw);
    MendedVessel vessel{std::move(raw), {}, {}, true};
    vessel.openings = find_openings(vessel.surface);
    if (const Result<void> mended = mend(vessel, mode, lumen_needs()); !mended.ok()) return mended.error();
    keep_one_shell(vessel, near);
    drop_unreferenced_vertices(vessel.surface);
    if (const Result<void> apart = part_equal_vertices(vessel, lumen_needs()); !apart.ok()) return apart.error();
    const std::size_t loops = vessel.openings.size();
    point_inward(vessel.openings, vessel.surface);
    if (loops > 0) vessel.repairs.push_back(fmt::format("open_ends: {} capped, {} of them in this shell", loops, vessel.openings.size()));
    return vessel;
}

Result<MendedVessel> mend_organ(TriMesh raw, MendMode mode) {
    if (const Result<void> usable = check_numbers(raw); !usable.ok()) return usable.error();
    drop_unreferenced_vertices(raw);
    MendedVessel organ{std::move(raw), {}, {}, true};
    if (const Result<void> mended = mend(organ, mode, organ_needs()); !mended.ok()) return mended.error();
    if (mode == MendMode::Automatic) {
        const Result<RepairStep> inner = apply_repair(organ.surface, Repair::DropInnerShells);
        if (inner.ok() && inner->shells_removed > 0) organ.repairs.push_back(inner->to_string()), organ.was_sound = false;
    }
    drop_unreferenced_vertices(organ.surface);
    if (const Result<void> apart = part_equal_vertices(organ, organ_needs()); !apart.ok()) return apart.error();
    return organ;
}

} // namespace trocar::engine
