#include "spheretree/update/covering_tree.hpp"

#include "spheretree/bounding.hpp"
#include "spheretree/hierarchy.hpp"

#include <algorithm>

namespace trocar::spheretree {

namespace {

/// Corners of a leaf's triangles, each once, ascending.
void add_leaf_vertices(const TriMesh& mesh, std::span<const Index> triangles, std::vector<Index>& vertices) {
    const auto begin = static_cast<std::ptrdiff_t>(vertices.size());
    for (const Index t : triangles)
        for (const Index v : mesh.triangles[t]) vertices.push_back(v);
    std::sort(vertices.begin() + begin, vertices.end());
    vertices.erase(std::unique(vertices.begin() + begin, vertices.end()), vertices.end());
}

Vec3 triangle_centre(const TriMesh& mesh, const Triangle& t) {
    const Vec3 centre = (mesh.vertices[t[0]] + mesh.vertices[t[1]] + mesh.vertices[t[2]]) / 3.0;
    return is_finite(centre) ? centre : Vec3::Zero(); // sorted somewhere; its sphere ends up empty
}

Sphere enclose_points(std::span<const Vec3> position, std::span<const Index> ids, std::vector<Sphere>& scratch) {
    scratch.clear();
    for (const Index v : ids) scratch.push_back({position[v], is_finite(position[v]) ? 0.0 : -1.0});
    return enclose(scratch);
}

} // namespace

CoveringTree build_covering_tree(const TriMesh& mesh, const CoveringOptions& options) {
    CoveringTree covering;
    std::vector<Vec3> centres;
    centres.reserve(mesh.triangles.size());
    for (const Triangle& t : mesh.triangles) centres.push_back(triangle_centre(mesh, t));
    covering.tree = split_by_median(centres, options.branching, options.leaf_triangles);

    SphereTree& tree = covering.tree;
    std::vector<Sphere> scratch;
    std::vector<Index> beneath;
    covering.vertex_begin.push_back(0);
    for (Index s = 0; s < tree.sphere_count(); ++s) {
        beneath.clear();
        add_leaf_vertices(mesh, tree.items_of(s), beneath);
        tree.spheres[s] = enclose_points(mesh.vertices, beneath, scratch);
        if (tree.is_leaf(s)) covering.vertices.insert(covering.vertices.end(), beneath.begin(), beneath.end());
        covering.vertex_begin.push_back(static_cast<Index>(covering.vertices.size()));
    }
    return covering;
}

namespace {

/// Centre: midway between the mean corners at both ends. A corner's distance to a fixed point along a straight line is
/// largest at one of the ends, so the two ends bound the step.
Sphere enclose_moving(std::span<const Index> ids, std::span<const Vec3> t0, std::span<const Vec3> t1) noexcept {
    Vec3 centre = Vec3::Zero();
    for (const Index v : ids) centre += t0[v] + t1[v];
    centre /= 2.0 * static_cast<double>(ids.size());
    double radius_sq = 0.0;
    for (const Index v : ids) radius_sq = std::max({radius_sq, (t0[v] - centre).squaredNorm(), (t1[v] - centre).squaredNorm()});
    if (!is_finite(centre)) return {};
    return {centre, std::sqrt(radius_sq) * kRoundOut};
}

} // namespace

void update_covering_spheres(const CoveringTree& covering, std::span<const Vec3> vertices_t0, std::span<const Vec3> vertices_t1,
                             std::vector<Sphere>& spheres) {
    const SphereTree& tree = covering.tree;
    spheres.resize(tree.sphere_count());
    for (Index s = static_cast<Index>(tree.sphere_count()); s-- > 0;) {
        if (tree.is_leaf(s)) {
            const Index begin = covering.vertex_begin[s];
            const auto ids = std::span(covering.vertices).subspan(begin, covering.vertex_begin[s + 1] - begin);
            spheres[s] = enclose_moving(ids, vertices_t0, vertices_t1);
        } else {
            const auto children = std::span<const Sphere>(spheres).subspan(tree.first_child[s], tree.child_count[s]);
            spheres[s] = enclose(children, 1);
        }
    }
}

} // namespace trocar::spheretree
