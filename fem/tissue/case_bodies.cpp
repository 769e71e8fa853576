#include "fem/tissue/case_bodies.hpp"

#include <Eigen/Geometry>

#include <cmath>

namespace trocar::fem {

TissueModel make_body(const TetMesh& mesh, double young, double poisson_ratio, TetElements elements, const std::vector<Index>& pinned, double density, Index sheet) {
    Material material{.law = MaterialLaw::NeoHookean, .young_modulus = young, .poisson_ratio = poisson_ratio, .density = density};
    material.elements = elements;
    return make_tissue_model(mesh, material, pinned, {}, sheet).value();
}

std::vector<Index> nodes_across(const TetMesh& mesh, int axis, double value) {
    std::vector<Index> nodes;
    for (Index node = 0; node < mesh.vertices.size(); ++node)
        if (std::abs(mesh.vertices[node][axis] - value) < 1e-9) nodes.push_back(node);
    return nodes;
}

Field press_out(const TetMesh& mesh, const TriMesh& inner) {
    Field force(mesh.vertices.size(), Vec3::Zero());
    for (const Triangle& t : inner.triangles) {
        const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
        for (const Index node : t) force[node] += (b - a).cross(c - a) / 6.0;
    }
    return force;
}

} // namespace trocar::fem
