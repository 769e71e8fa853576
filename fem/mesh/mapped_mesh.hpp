// Tetrahedra of bodies that are known by a formula, for measurements and tests: grids that are mapped, and surfaces in layers.
#pragma once

#include "base/mesh.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>

namespace trocar::fem {

namespace mapped_detail {

inline void add_tet(TetMesh& mesh, Tet tet) {
    const auto edge = [&](std::size_t k) { return Vec3(mesh.vertices[tet[k]] - mesh.vertices[tet[0]]); };
    if (edge(1).cross(edge(2)).dot(edge(3)) < 0.0) std::swap(tet[2], tet[3]);
    mesh.tets.push_back(tet);
}

} // namespace mapped_detail

/// Cubes split in five, alternately: the least stiff of the usual grids.
/// place   (u, v, w) in [0, 1] -> m
template <class Place>
[[nodiscard]] TetMesh make_mapped_grid(std::array<Index, 3> cells, const Place& place) {
    TetMesh mesh;
    const auto id = [&](Index i, Index j, Index k) { return (k * (cells[1] + 1) + j) * (cells[0] + 1) + i; };
    for (Index k = 0; k <= cells[2]; ++k)
        for (Index j = 0; j <= cells[1]; ++j)
            for (Index i = 0; i <= cells[0]; ++i) mesh.vertices.push_back(place(double(i) / cells[0], double(j) / cells[1], double(k) / cells[2]));
    constexpr Index kCorners[5][4] = {{0, 3, 5, 6}, {1, 0, 3, 5}, {2, 0, 3, 6}, {4, 0, 5, 6}, {7, 3, 5, 6}};
    for (Index k = 0; k < cells[2]; ++k)
        for (Index j = 0; j < cells[1]; ++j)
            for (Index i = 0; i < cells[0]; ++i)
                for (const auto& corners : kCorners) {
                    Tet tet{};
                    for (std::size_t c = 0; c < 4; ++c) {
                        const Index corner = corners[c] ^ ((i + j + k) & 1);
                        tet[c] = id(i + (corner & 1), j + (corner >> 1 & 1), k + (corner >> 2));
                    }
                    mapped_detail::add_tet(mesh, tet);
                }
    return mesh;
}

/// Layers of prisms over a surface, each split in three along the diagonals that begin at the lower vertex.
/// place   (vertex, share in [0, 1] from the first layer to the last) -> m
template <class Place>
[[nodiscard]] TetMesh make_layered_mesh(const TriMesh& surface, Index layers, const Place& place) {
    TetMesh mesh;
    const Index count = static_cast<Index>(surface.vertices.size());
    for (Index layer = 0; layer <= layers; ++layer)
        for (Index v = 0; v < count; ++v) mesh.vertices.push_back(place(v, double(layer) / layers));
    for (Index layer = 0; layer < layers; ++layer)
        for (Triangle t : surface.triangles) {
            std::sort(t.begin(), t.end());
            const Index low = layer * count, high = low + count;
            mapped_detail::add_tet(mesh, {t[0] + low, t[1] + low, t[2] + low, t[2] + high});
            mapped_detail::add_tet(mesh, {t[0] + low, t[1] + low, t[1] + high, t[2] + high});
            mapped_detail::add_tet(mesh, {t[0] + low, t[0] + high, t[1] + high, t[2] + high});
        }
    return mesh;
}

/// A sphere of radius 1: an octahedron whose edges are parted in `parts`.
[[nodiscard]] inline TriMesh make_octasphere(Index parts) {
    TriMesh sphere;
    for (int octant = 0; octant < 8; ++octant) {
        const Vec3 sign(octant & 1 ? -1 : 1, octant & 2 ? -1 : 1, octant & 4 ? -1 : 1);
        const auto vertex = [&](Index i, Index j) { // of the flat octahedron; found again where octants meet
            const Vec3 p = sign.cwiseProduct(Vec3(i, j, parts - i - j)), unit = p / p.norm();
            for (Index v = 0; v < sphere.vertices.size(); ++v)
                if ((sphere.vertices[v] - unit).squaredNorm() < 1e-18) return v;
            sphere.vertices.push_back(unit);
            return static_cast<Index>(sphere.vertices.size() - 1);
        };
        const bool mirrored = sign[0] * sign[1] * sign[2] < 0.0;
        const auto add = [&](Index a, Index b, Index c) { sphere.triangles.push_back(mirrored ? Triangle{a, c, b} : Triangle{a, b, c}); };
        for (Index i = 0; i < parts; ++i)
            for (Index j = 0; i + j < parts; ++j) {
                add(vertex(i, j), vertex(i + 1, j), vertex(i, j + 1));
                if (i + j + 1 < parts) add(vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1));
            }
    }
    return sphere;
}

} // namespace trocar::fem
