// Isotropic remeshing of an implicit surface: split long edges, collapse short ones, flip towards valence 6, relax along
// the surface, project back onto the field (Botsch & Kobbelt 2004). Deviates: edge lengths follow a size field, collapses
// go from the shortest edge up, and every change that would turn a triangle over or break the manifold is refused.
#pragma once

#include "assets/anatomy/field.hpp"
#include "base/mesh.hpp"

#include <functional>

namespace trocar::anatomy {

struct RemeshOptions {
    std::size_t triangles = 20000; // aimed at; the size field is scaled to it
    int rounds = 8;
};

/// mesh   closed, manifold, oriented outwards, near the zero set; stays so
/// size   relative edge length wanted at a point, > 0: only ratios matter
/// returns the remeshed surface, vertices on the field's zero set within about 1e-3 of an edge
[[nodiscard]] TriMesh remesh(const TriMesh& mesh, const Field& field, const std::function<double(const Vec3&)>& size,
                             const RemeshOptions& options);

} // namespace trocar::anatomy
