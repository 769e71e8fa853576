#include "base/sharp_edges.hpp"

#include "base/topology.hpp"

#include <algorithm>
#include <span>

namespace trocar {

std::vector<std::array<Index, 2>> find_sharp_edges(const TriMesh& surface, double cosine) {
    const std::vector<Vec3>& at = surface.vertices;
    const auto normal_of = [&](Index face) {
        const Triangle& t = surface.triangles[face];
        return Vec3((at[t[1]] - at[t[0]]).cross(at[t[2]] - at[t[0]]));
    };
    std::vector<std::array<Index, 2>> sharp;
    for_each_edge(sorted_edge_uses(surface.triangles), [&](std::span<const EdgeUse> uses) {
        if (uses.size() != 2) return;
        const Vec3 normal = normal_of(uses[0].triangle), beside = normal_of(uses[1].triangle);
        if (!(normal.dot(beside) < cosine * normal.norm() * beside.norm())) return;
        const Triangle& other = surface.triangles[uses[1].triangle];
        const Vec3& apex = at[other[(uses[1].corner + 2u) % 3u]];
        if (normal.dot(apex - at[uses[0].lo]) < 0.0) sharp.push_back({uses[0].lo, uses[0].hi}); // else a crease
    });
    return sharp;
}

} // namespace trocar
