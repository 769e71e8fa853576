// Crossing triangles: cut them out with a margin that grows from round to round, close the holes, test again.
#include "base/repair_steps.hpp"
#include "base/topology.hpp"

#include <algorithm>
#include <limits>

namespace trocar::repairs {
namespace {

constexpr double kLeftoverShare = 0.1; // parts with less than this share of the area of the largest part of their shell, left over by a cut, go

/// Takes in every triangle that shares a vertex with one already in.
void grow(const TriMesh& mesh, std::vector<bool>& chosen) {
    std::vector<bool> vertex(mesh.vertices.size(), false);
    for (std::size_t t = 0; t < chosen.size(); ++t)
        if (chosen[t])
            for (const Index v : mesh.triangles[t]) vertex[v] = true;
    for (std::size_t t = 0; t < chosen.size(); ++t)
        for (const Index v : mesh.triangles[t])
            if (vertex[v]) chosen[t] = true;
}

/// Parts that a cut left over: much smaller than what they were cut from.
std::size_t drop_leftovers(TriMesh& mesh, const std::vector<Index>& old_shell) {
    const Components now = find_components(mesh.triangles, mesh.vertices.size(), Joined::BySharedEdges);
    std::vector<double> part_area(now.count, 0.0);
    std::vector<Index> part_shell(now.count, 0);
    std::vector<double> largest;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        part_area[now.of_triangle[t]] += area(mesh, mesh.triangles[t]);
        part_shell[now.of_triangle[t]] = old_shell[t];
    }
    largest.assign(old_shell.empty() ? 0 : *std::max_element(old_shell.begin(), old_shell.end()) + 1, 0.0);
    for (std::size_t p = 0; p < now.count; ++p) largest[part_shell[p]] = std::max(largest[part_shell[p]], part_area[p]);
    std::vector<bool> keep(mesh.triangles.size());
    for (std::size_t t = 0; t < keep.size(); ++t) {
        const Index part = now.of_triangle[t];
        keep[t] = part_area[part] >= kLeftoverShare * largest[part_shell[part]];
    }
    return keep_triangles(mesh, keep);
}

} // namespace

Result<RepairStep> drop_self_intersections(TriMesh& mesh, int most_rounds, std::size_t max_compared) {
    if (const Result<void> check = check_edge_manifold(mesh, Repair::DropSelfIntersections); !check) return check.error();
    const Error too_many{ErrorCode::BadMesh, "too many long triangles lie upon each other for crossings to be counted"};
    RepairStep step;
    for (int round = 0; round < most_rounds; ++round) {
        const SelfIntersections crossings = find_self_intersections(mesh, std::numeric_limits<std::size_t>::max(), Crossing::Proper, max_compared);
        if (!crossings.complete) return too_many;
        if (crossings.count == 0) return step;
        std::vector<bool> chosen(mesh.triangles.size(), false);
        for (const auto& [a, b] : crossings.pairs) chosen[a] = chosen[b] = true;
        for (int ring = 0; ring < 1 + round / 3; ++ring) grow(mesh, chosen);
        chosen.flip();
        const Components shells = find_components(mesh.triangles, mesh.vertices.size(), Joined::BySharedEdges);
        std::vector<Index> old_shell;
        for (std::size_t t = 0; t < chosen.size(); ++t)
            if (chosen[t]) old_shell.push_back(shells.of_triangle[t]);
        step.triangles_removed += keep_triangles(mesh, chosen);
        step.triangles_removed += drop_leftovers(mesh, old_shell);
        if (mesh.triangles.empty()) return Error{ErrorCode::BadMesh, "nothing is left once crossing triangles are out"};
        const Result<RepairStep> filled = fill_holes(mesh);
        if (!filled) return filled.error();
        step.holes_filled += filled->holes_filled;
        step.triangles_added += filled->triangles_added;
        step.triangles_removed += filled->triangles_removed;
        step.vertices_split += filled->vertices_split;
    }
    const SelfIntersections left = find_self_intersections(mesh, 1, Crossing::Proper, max_compared);
    if (!left.complete) return too_many;
    if (left.count == 0) return step;
    return Error{ErrorCode::BadMesh, std::to_string(left.count) + " pairs of triangles still cross after " + std::to_string(most_rounds) +
                                         " rounds: parts of the surface lie inside one another"};
}

} // namespace trocar::repairs
