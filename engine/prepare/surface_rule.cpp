#include "engine/prepare/surface_rule.hpp"

#include "base/self_intersection.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <utility>

namespace trocar::engine {

namespace {

constexpr std::size_t kShownPairs = 4;
constexpr std::size_t kLargestFan = 5'000; // triangles round a vertex

/// The vertex with the most triangles, and how many.
std::pair<std::size_t, std::size_t> find_largest_fan(std::span<const Triangle> triangles, std::size_t vertices) {
    std::vector<std::size_t> count(vertices, 0);
    for (const Triangle& t : triangles)
        for (const Index v : t) ++count[v];
    const auto most = std::max_element(count.begin(), count.end());
    return most == count.end() ? std::pair<std::size_t, std::size_t>{} : std::pair(static_cast<std::size_t>(most - count.begin()), *most);
}

/// Without copies and without those that repeat a vertex.
std::vector<Triangle> list_distinct(std::span<const Triangle> triangles) {
    std::vector<Triangle> distinct(triangles.begin(), triangles.end());
    for (Triangle& t : distinct) std::sort(t.begin(), t.end());
    std::erase_if(distinct, [](const Triangle& t) { return t[0] == t[1] || t[1] == t[2]; });
    std::sort(distinct.begin(), distinct.end());
    distinct.erase(std::unique(distinct.begin(), distinct.end()), distinct.end());
    return distinct;
}

std::string list_triangles(const SurfaceReport& report) {
    if (report.bad_triangles.empty()) return "";
    return fmt::format("; first bad triangles: {}", fmt::join(report.bad_triangles, ", "));
}

/// Of what can be counted edge by edge and vertex by vertex.
std::optional<SurfaceDefect> find_open_defect(const SurfaceReport& r, const std::string& wanted) {
    const std::string where = list_triangles(r);
    const auto defect = [&where](std::string what, Repair repair) { return SurfaceDefect{std::move(what) + where, repair}; };
    if (r.degenerate_triangles > 0)
        return defect(fmt::format("{} needs triangles with area, {} have none", wanted, r.degenerate_triangles), Repair::DropDegenerate);
    if (r.duplicate_triangles > 0) return defect(fmt::format("{} triangles stand twice", r.duplicate_triangles), Repair::DropDuplicates);
    if (r.nonmanifold_edges > 0)
        return defect(fmt::format("{} edges belong to three or more triangles", r.nonmanifold_edges), Repair::DropNonManifold);
    if (!r.closed())
        return defect(fmt::format("{} needs a closed surface, this one has {} border edges", wanted, r.boundary_edges), Repair::FillHoles);
    if (!r.oriented()) return defect(fmt::format("{} edges are used the same way by both triangles", r.inconsistent_edges), Repair::Orient);
    if (r.nonmanifold_vertices > 0) return defect(fmt::format("{} vertices are pinched", r.nonmanifold_vertices), Repair::DropNonManifold);
    if (!(r.signed_volume > 0.0)) return SurfaceDefect{"the surface is inside out", Repair::Orient};
    return std::nullopt;
}

/// Of several shells some may be inside out, and the whole still hold a volume.
std::optional<SurfaceDefect> find_turned_shells(const TriMesh& mesh, const SurfaceReport& report) {
    if (report.components < 2) return std::nullopt;
    TriMesh oriented = mesh;
    const Result<RepairStep> step = apply_repair(oriented, Repair::Orient);
    if (!step.ok() || step->triangles_flipped == 0) return std::nullopt;
    return SurfaceDefect{fmt::format("{} triangles belong to shells that are inside out", step->triangles_flipped), Repair::Orient};
}

std::optional<SurfaceDefect> find_crossings(const TriMesh& mesh, const std::string& wanted) {
    const SelfIntersections crossings = find_self_intersections(mesh, kShownPairs);
    if (!crossings.complete && crossings.count == 0)
        return SurfaceDefect{
            fmt::format("{} needs a surface that does not pass through itself: more than {} pairs of triangles are too near "
                        "to each other to tell; expected no long thin triangles upon each other, such as of one polygon "
                        "with very many corners",
                        wanted, kMostCompared),
            std::nullopt};
    if (crossings.count == 0) return std::nullopt;
    std::vector<std::string> pairs;
    for (const auto& [a, b] : crossings.pairs) pairs.push_back(fmt::format("{} with {}", a, b));
    return SurfaceDefect{fmt::format("{} needs a surface that does not pass through itself, {} pairs of triangles cross; "
                                     "first bad triangles: {}",
                                     wanted, crossings.count, fmt::join(pairs, ", ")),
                         Repair::DropSelfIntersections};
}

} // namespace

std::optional<SurfaceDefect> find_defect(const TriMesh& mesh, const SurfaceReport& r, const SurfaceNeeds& needs) {
    if (r.triangles == 0) return SurfaceDefect{"the surface has no triangles", std::nullopt};
    if (!r.finite()) return SurfaceDefect{fmt::format("{} vertices are not finite", r.non_finite_vertices), std::nullopt};
    if (!needs.closed) {
        if (r.closed() && r.oriented() && r.nonmanifold_edges == 0 && r.signed_volume < 0.0)
            return SurfaceDefect{"the closed surface is inside out", Repair::Orient};
        return std::nullopt;
    }
    if (auto defect = find_open_defect(r, needs.wanted)) return defect;
    if (auto defect = find_turned_shells(mesh, r)) return defect;
    return needs.uncrossed ? find_crossings(mesh, needs.wanted) : std::nullopt;
}

std::string describe_crossings(const SelfIntersections& crossings) {
    if (crossings.count > 0)
        return fmt::format("passes through itself: {} pairs of triangles cross{}", crossings.count, crossings.complete ? "" : ", and more may");
    if (crossings.complete) return "";
    return fmt::format("may pass through itself: more than {} pairs of triangles are too near to each other to tell", kMostCompared);
}

Result<void> check_fans(const TriMesh& mesh) {
    if (find_largest_fan(mesh.triangles, mesh.vertices.size()).second <= kLargestFan) return {};
    const auto [vertex, count] = find_largest_fan(list_distinct(mesh.triangles), mesh.vertices.size());
    if (count <= kLargestFan) return {};
    const Vec3& p = mesh.vertices[vertex];
    return Error{ErrorCode::BadMesh,
                 fmt::format("{} triangles share vertex {} at ({:.6g}, {:.6g}, {:.6g}) m; expected at most {}, as of polygons with fewer "
                             "corners: triangulate the surface evenly (\"remesh\" in mesh programs)",
                             count, vertex, p.x(), p.y(), p.z(), kLargestFan)};
}

std::vector<std::string> list_leniencies(const SurfaceReport& r) {
    std::vector<std::string> notes;
    if (r.components > 1) notes.push_back(fmt::format("{} separate shells", r.components));
    if (!r.closed()) notes.push_back(fmt::format("open: {} border edges", r.boundary_edges));
    if (r.nonmanifold_edges > 0) notes.push_back(fmt::format("{} edges of three or more triangles", r.nonmanifold_edges));
    if (r.inconsistent_edges > 0) notes.push_back(fmt::format("{} edges with neighbours turned apart", r.inconsistent_edges));
    if (r.degenerate_triangles > 0) notes.push_back(fmt::format("{} triangles without area", r.degenerate_triangles));
    if (r.duplicate_triangles > 0) notes.push_back(fmt::format("{} triangles stand twice", r.duplicate_triangles));
    return notes;
}

} // namespace trocar::engine
