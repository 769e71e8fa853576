// Small bodies shared by the hard cases of elements and time steps.
#pragma once

#include "fem/mesh/bar_mesh.hpp"
#include "fem/tissue/tissue.hpp"

#include <cmath>
#include <random>
#include <stdexcept>

namespace trocar::engine {

/// Box of nx x ny x nz cells of size `cell` [m], six tets each around the cell's diagonal.
inline TetMesh make_bar(Index nx, Index ny, Index nz, double cell) { return fem::make_bar_mesh({nx, ny, nz}, cell, 0.0); }

inline fem::Material make_material(fem::MaterialLaw law, double poisson_ratio = 0.3) {
    return {.law = law, .young_modulus = 5000.0, .poisson_ratio = poisson_ratio, .density = 1000.0};
}

/// The mesh must be sound.
inline fem::TissueModel make_model(const TetMesh& mesh, const fem::Material& material, const std::vector<Index>& pinned = {}) {
    auto model = fem::make_tissue_model(mesh, material, pinned);
    if (!model) throw std::runtime_error(model.error().to_string());
    return std::move(model).value();
}

inline std::vector<Index> nodes_at(const TetMesh& mesh, int axis, double value) {
    std::vector<Index> nodes;
    for (Index node = 0; node < mesh.vertices.size(); ++node)
        if (std::abs(mesh.vertices[node][axis] - value) < 1e-9) nodes.push_back(node);
    return nodes;
}

/// Uniform in a cube of half width `size`, the same on every machine (std distributions differ between libraries).
inline Vec3 random_vec(std::mt19937_64& random, double size) {
    const auto number = [&] { return size * static_cast<double>(static_cast<std::int64_t>(random())) * 0x1p-63; };
    const double x = number(), y = number(), z = number();
    return {x, y, z};
}

inline std::vector<Vec3> zeros(std::size_t count) { return std::vector<Vec3>(count, Vec3::Zero()); }

inline constexpr fem::MaterialLaw kLaws[] = {fem::MaterialLaw::StVK, fem::MaterialLaw::Corotational, fem::MaterialLaw::NeoHookean};

} // namespace trocar::engine
