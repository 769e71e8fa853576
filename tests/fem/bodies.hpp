// Small bodies and random deformations that the tests of this folder share.
#pragma once

#include "fem/tissue/tissue.hpp"

#include <random>

namespace trocar::fem::test {

/// Box of nx x ny x nz cells of size `cell` [m], six tets each around the cell's diagonal.
inline TetMesh make_bar(Index nx, Index ny, Index nz, double cell) {
    TetMesh mesh;
    const auto id = [&](Index i, Index j, Index k) { return (k * (ny + 1) + j) * (nx + 1) + i; };
    for (Index k = 0; k <= nz; ++k)
        for (Index j = 0; j <= ny; ++j)
            for (Index i = 0; i <= nx; ++i) mesh.vertices.push_back(cell * Vec3(i, j, k));
    constexpr int kPaths[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {1, 0, 2}, {0, 2, 1}, {2, 1, 0}};
    for (Index k = 0; k < nz; ++k)
        for (Index j = 0; j < ny; ++j)
            for (Index i = 0; i < nx; ++i)
                for (int path = 0; path < 6; ++path) {
                    Index corner[3] = {i, j, k};
                    Tet tet{id(i, j, k), 0, 0, 0};
                    for (std::size_t step = 0; step < 3; ++step) {
                        ++corner[kPaths[path][step]];
                        tet[step + 1] = id(corner[0], corner[1], corner[2]);
                    }
                    if (path >= 3) std::swap(tet[1], tet[2]); // odd permutations are inverted
                    mesh.tets.push_back(tet);
                }
    return mesh;
}

/// Of 5 kPa at small strain, whatever the law; hgo's fibres come on top.
inline Material make_material(MaterialLaw law, double poisson_ratio = 0.3) {
    Material material{.law = law, .young_modulus = 5000.0, .poisson_ratio = poisson_ratio, .density = 1000.0};
    const double mu = 5000.0 / (2.0 * (1.0 + poisson_ratio));
    material.c10 = 0.35 * mu;
    material.c01 = 0.15 * mu;
    material.alpha1 = 4.0, material.mu1 = 0.6 * 2.0 * mu / 4.0;
    material.alpha2 = -3.0, material.mu2 = -0.3 * 2.0 * mu / 3.0;
    material.alpha3 = 1.5, material.mu3 = 0.1 * 2.0 * mu / 1.5;
    material.k1 = 2000.0, material.k2 = 3.0, material.kappa = 0.1;
    material.fibre1 = Vec3(1.0, 0.5, 0.2), material.fibre2 = Vec3(0.3, -1.0, 0.4);
    return material;
}

inline TissueModel make_model(const TetMesh& mesh, const Material& material, std::vector<Index> pinned = {}) {
    auto model = make_tissue_model(mesh, material, pinned);
    if (!model) throw std::runtime_error(model.error().to_string());
    return std::move(model).value();
}

inline std::vector<Index> nodes_at(const TetMesh& mesh, int axis, double value) {
    std::vector<Index> nodes;
    for (Index node = 0; node < mesh.vertices.size(); ++node)
        if (std::abs(mesh.vertices[node][axis] - value) < 1e-9) nodes.push_back(node);
    return nodes;
}

inline Vec3 random_vec(std::mt19937_64& random, double size) {
    std::uniform_real_distribution<double> range(-size, size);
    const double x = range(random), y = range(random), z = range(random);
    return {x, y, z};
}

inline Mat3 random_rotation(std::mt19937_64& random) {
    std::normal_distribution<double> normal;
    const double w = normal(random), x = normal(random), y = normal(random), z = normal(random);
    return Eigen::Quaterniond(w, x, y, z).normalized().toRotationMatrix();
}

inline std::vector<Vec3> zeros(std::size_t count) { return std::vector<Vec3>(count, Vec3::Zero()); }

/// Those that E and nu say all of.
inline constexpr MaterialLaw kLaws[] = {MaterialLaw::StVK, MaterialLaw::Corotational, MaterialLaw::NeoHookean};
inline constexpr MaterialLaw kAllLaws[] = {MaterialLaw::StVK,         MaterialLaw::Corotational, MaterialLaw::NeoHookean,
                                           MaterialLaw::MooneyRivlin, MaterialLaw::Ogden,        MaterialLaw::Hgo};
inline constexpr const char* kLawNames[] = {"StVK", "Corotational", "NeoHookean", "MooneyRivlin", "Ogden", "Hgo"};
inline constexpr TetElements kElements[] = {TetElements::Linear, TetElements::Patched};

} // namespace trocar::fem::test
