// The single repairs behind repair.hpp. Each takes a mesh whose indices are in range and whose vertices are finite.
#pragma once

#include "base/mesh.hpp"
#include "base/repair_types.hpp"
#include "base/result.hpp"
#include "base/self_intersection.hpp"

namespace trocar::repairs {

[[nodiscard]] Result<RepairStep> weld(TriMesh& mesh, double tolerance);
[[nodiscard]] Result<RepairStep> drop_degenerate(TriMesh& mesh);
[[nodiscard]] Result<RepairStep> drop_duplicates(TriMesh& mesh);
[[nodiscard]] Result<RepairStep> drop_non_manifold(TriMesh& mesh);
[[nodiscard]] Result<RepairStep> fill_holes(TriMesh& mesh);
[[nodiscard]] Result<RepairStep> orient(TriMesh& mesh);
[[nodiscard]] Result<RepairStep> drop_inner_shells(TriMesh& mesh);
[[nodiscard]] Result<RepairStep> keep_largest(TriMesh& mesh);
/// max_compared  as of find_self_intersections; a search that gives up is an error
[[nodiscard]] Result<RepairStep> drop_self_intersections(TriMesh& mesh, int most_rounds, std::size_t max_compared = kMostCompared);

/// Error where the step took more than it may.
[[nodiscard]] Result<void> check_removal(const RepairStep& step, const RepairOptions& options);

/// Triangles without area among those from `first` on: two corners in one place become one, a corner on the opposite edge goes into
/// the triangle across it. All that cannot be mended without opening the surface stays.
void flatten_new(TriMesh& mesh, Index first, RepairStep& step);

/// Error unless every edge has one or two triangles and no triangle repeats a vertex; names the repair that helps.
[[nodiscard]] Result<void> check_edge_manifold(const TriMesh& mesh, Repair asked);

/// Same winding on both sides of every edge; each shell keeps what most of its triangles had. Returns how many turned.
[[nodiscard]] Result<std::size_t> orient_consistently(TriMesh& mesh);

/// Gives each fan around a pinched vertex its own copy, where split[vertex] says so. Returns the number of copies.
std::size_t split_vertices(TriMesh& mesh, const std::vector<bool>& split, bool across_manifold_only);

/// Keeps triangles for which keep[t]; returns how many went. Unreferenced vertices stay.
std::size_t keep_triangles(TriMesh& mesh, const std::vector<bool>& keep);

[[nodiscard]] double area(const TriMesh& mesh, const Triangle& t) noexcept;

/// [triangle] lies on the inner skin of a double shell: a closed thin sheet that wraps a hollow, as segmented capsules do, with
/// openings where both skins meet. All false for a surface that is no such sheet.
[[nodiscard]] std::vector<bool> find_inner_skin(const TriMesh& closed_shell);

/// The connected parts of a mesh as meshes of their own.
struct Part {
    TriMesh mesh;
    std::vector<Index> triangle_ids; // in the whole
};
[[nodiscard]] std::vector<Part> split_into_shells(const TriMesh& mesh);

} // namespace trocar::repairs
