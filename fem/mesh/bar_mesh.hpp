// A bar of tetrahedra for measurements and tests: a grid of cubes, each split in six around its diagonal (Kuhn), interior
// nodes moved by up to 15 % of the spacing.
#pragma once

#include "base/mesh.hpp"

#include <utility>

namespace trocar::fem {

/// cells [3] along x, y, z; cell m; jitter [-] of the spacing; the same for the same arguments on every machine.
[[nodiscard]] inline TetMesh make_bar_mesh(std::array<Index, 3> cells, double cell, double jitter) {
    TetMesh mesh;
    const auto id = [&](Index i, Index j, Index k) { return (k * (cells[1] + 1) + j) * (cells[0] + 1) + i; };
    std::uint64_t seed = 1;
    const auto shift = [&] { // uniform in [-1, 1): xorshift64* (Vigna 2016)
        seed ^= seed >> 12, seed ^= seed << 25, seed ^= seed >> 27;
        return static_cast<double>(static_cast<std::int64_t>(seed * 0x2545f4914f6cdd1dULL)) * 0x1p-63;
    };
    for (Index k = 0; k <= cells[2]; ++k)
        for (Index j = 0; j <= cells[1]; ++j)
            for (Index i = 0; i <= cells[0]; ++i) {
                Vec3 x = cell * Vec3(i, j, k);
                if (i > 0 && i < cells[0] && j > 0 && j < cells[1] && k > 0 && k < cells[2])
                    for (int axis = 0; axis < 3; ++axis) x[axis] += jitter * cell * shift();
                mesh.vertices.push_back(x);
            }
    constexpr int kPaths[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {1, 0, 2}, {0, 2, 1}, {2, 1, 0}};
    for (Index k = 0; k < cells[2]; ++k)
        for (Index j = 0; j < cells[1]; ++j)
            for (Index i = 0; i < cells[0]; ++i)
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

} // namespace trocar::fem
