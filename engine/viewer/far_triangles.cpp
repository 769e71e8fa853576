#include "engine/viewer/far_triangles.hpp"

#include "base/simplify.hpp"
#include "base/triangle_tree.hpp"

#include <algorithm>

namespace trocar::engine::viewer {

/// The surface's vertex that is next to p, by the triangle that p lies on.
static Index vertex_at(const TriMesh& surface, const TriangleTree& tree, const Vec3& p) {
    const auto on = tree.closest(p);
    if (!on) return kNoIndex;
    const auto heaviest = std::max_element(on->bary.begin(), on->bary.end()) - on->bary.begin();
    return surface.triangles[on->triangle][static_cast<std::size_t>(heaviest)];
}

std::vector<Triangle> far_triangles(const TriMesh& surface, std::size_t wanted) {
    if (surface.triangles.size() <= wanted) return {};
    const Result<TriMesh> simple = simplify(surface, wanted);
    if (!simple || simple->triangles.size() >= surface.triangles.size()) return {};
    const TriangleTree tree(surface);
    std::vector<Index> vertex;
    for (const Vec3& p : simple->vertices) vertex.push_back(vertex_at(surface, tree, p));
    std::vector<Triangle> far;
    for (const Triangle& t : simple->triangles) {
        const Triangle own{vertex[t[0]], vertex[t[1]], vertex[t[2]]};
        if (own[0] == own[1] || own[1] == own[2] || own[2] == own[0]) continue; // its corners went to the same vertex
        if (std::find(own.begin(), own.end(), kNoIndex) == own.end()) far.push_back(own);
    }
    return far;
}

} // namespace trocar::engine::viewer
