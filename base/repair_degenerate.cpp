// Triangles without area. A needle (two corners in one place) goes by merging these two; a cap (a corner on the opposite edge)
// by giving its long edge's other triangle that corner, so that no gap opens.
#include "base/predicates.hpp"
#include "base/repair_steps.hpp"
#include "base/topology.hpp"

#include <algorithm>

namespace trocar::repairs {
namespace {

constexpr int kMaxRounds = 64; // each round does all that does not overlap; real files need two or three

bool repeats(const Triangle& t) noexcept { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; }

bool has_no_area(const TriMesh& mesh, const Triangle& t) noexcept {
    return are_collinear(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]);
}

std::size_t drop_repeating(TriMesh& mesh) {
    std::vector<bool> keep(mesh.triangles.size());
    for (std::size_t t = 0; t < keep.size(); ++t) keep[t] = !repeats(mesh.triangles[t]);
    return keep_triangles(mesh, keep);
}

/// Corners of a triangle from `first` on that lie in one place become one vertex everywhere.
std::size_t merge_coincident_corners(TriMesh& mesh, Index first = 0) {
    std::vector<Index> target(mesh.vertices.size());
    for (Index v = 0; v < target.size(); ++v) target[v] = v;
    const auto root = [&target](Index v) {
        while (target[v] != v) v = target[v];
        return v;
    };
    std::size_t merged = 0;
    for (const Triangle& t : std::span(mesh.triangles).subspan(first))
        for (std::size_t k = 0; k < 3; ++k) {
            const Index a = root(t[k]), b = root(t[(k + 1) % 3]);
            if (a == b || mesh.vertices[a] != mesh.vertices[b]) continue;
            target[std::max(a, b)] = std::min(a, b);
            ++merged;
        }
    if (merged > 0)
        for (Triangle& t : mesh.triangles)
            for (Index& v : t) v = root(v);
    return merged;
}

/// The corner that lies between the other two.
std::size_t middle_corner(const TriMesh& mesh, const Triangle& t) noexcept {
    std::size_t middle = 0;
    double longest = -1.0;
    for (std::size_t k = 0; k < 3; ++k) {
        const double opposite = (mesh.vertices[t[(k + 1) % 3]] - mesh.vertices[t[(k + 2) % 3]]).squaredNorm();
        if (opposite > longest) longest = opposite, middle = k;
    }
    return middle;
}

/// Flips long edges of caps from `first` on against their neighbours; caps at a border are removed. Returns the number removed.
std::size_t drop_caps(TriMesh& mesh, Index first_cap = 0) {
    const auto neighbours = triangle_neighbours(mesh.triangles);
    std::vector<bool> keep(mesh.triangles.size(), true), touched(mesh.triangles.size(), false);
    const std::size_t count = mesh.triangles.size();
    std::vector<std::array<Index, 2>> edges = unique_edges(mesh.triangles);
    std::size_t dropped = 0;
    for (Index t = first_cap; t < count; ++t) {
        const Triangle cap = mesh.triangles[t];
        if (touched[t] || !has_no_area(mesh, cap)) continue;
        const std::size_t k = middle_corner(mesh, cap);
        const Index middle = cap[k], from = cap[(k + 1) % 3], to = cap[(k + 2) % 3];
        const Index across = neighbours[t][(k + 1) % 3];
        touched[t] = true;
        if (across == kNoIndex) {
            keep[t] = false;
            ++dropped;
            continue;
        }
        Triangle& other = mesh.triangles[across];
        const auto apex = std::find_if(other.begin(), other.end(), [&](Index v) { return v != from && v != to; });
        const std::array<Index, 2> fresh{std::min(middle, *apex), std::max(middle, *apex)};
        if (touched[across] || *apex == middle || std::binary_search(edges.begin(), edges.end(), fresh)) continue;
        touched[across] = true;
        // the neighbour (.., to, from, apex) in whatever direction it runs: replace one end by the middle in each half
        Triangle first = other, second = other;
        std::replace(first.begin(), first.end(), to, middle);
        std::replace(second.begin(), second.end(), from, middle);
        other = first;
        mesh.triangles[t] = second;
        ++dropped;
    }
    keep_triangles(mesh, keep);
    return dropped;
}

std::size_t count_flat(const TriMesh& mesh, Index first) {
    const auto from = mesh.triangles.begin() + static_cast<std::ptrdiff_t>(first);
    return static_cast<std::size_t>(std::count_if(from, mesh.triangles.end(), [&mesh](const Triangle& t) { return has_no_area(mesh, t); }));
}

} // namespace

void flatten_new(TriMesh& mesh, Index first, RepairStep& step) {
    if (count_flat(mesh, first) == 0) return;
    TriMesh work = mesh;
    const SurfaceReport before = inspect_surface(mesh);
    std::size_t merged = 0;
    for (int round = 0; round < kMaxRounds; ++round) {
        merged += merge_coincident_corners(work, first);
        const auto old_end = work.triangles.begin() + static_cast<std::ptrdiff_t>(first);
        first -= static_cast<Index>(std::count_if(work.triangles.begin(), old_end, repeats));
        drop_repeating(work);
        if (drop_caps(work, first) == 0) break;
    }
    const SurfaceReport after = inspect_surface(work);
    if (after.boundary_edges > before.boundary_edges || after.nonmanifold_edges > before.nonmanifold_edges ||
        after.degenerate_triangles >= before.degenerate_triangles)
        return;
    step.vertices_merged += merged;
    mesh = std::move(work);
}

Result<RepairStep> drop_degenerate(TriMesh& mesh) {
    RepairStep step;
    const std::size_t before = mesh.triangles.size();
    std::size_t flips = 0;
    for (int round = 0; round < kMaxRounds; ++round) {
        step.vertices_merged += merge_coincident_corners(mesh);
        drop_repeating(mesh);
        const std::size_t caps = drop_caps(mesh);
        if (caps == 0) break;
        flips += caps;
    }
    std::vector<bool> keep(mesh.triangles.size());
    for (std::size_t t = 0; t < keep.size(); ++t) keep[t] = !has_no_area(mesh, mesh.triangles[t]);
    keep_triangles(mesh, keep); // what no flip could repair
    step.triangles_removed = before - mesh.triangles.size();
    step.triangles_flipped = flips;
    return step;
}

} // namespace trocar::repairs
