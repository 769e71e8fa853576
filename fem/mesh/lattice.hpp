// A coarse volume mesh from a body-centred cubic lattice: congruent tets, no slivers, so that the stable step is many times
// that of a mesh fitted to every surface triangle. Boundary nodes are drawn to the surface as far as no tet gets thin.
// This work is based on: Labelle & Shewchuk 2007, "Isosurface stuffing" (the lattice). Deviates: no stencils that cut tets,
// whose short edges would halve the step; the surface is met within a share of a cell instead, and the report says how well.
#pragma once

#include "base/mesh.hpp"
#include "base/result.hpp"

namespace trocar::fem {

struct LatticeOptions {
    double cell = 0.0;            // m, > 0: edge of a cube; 12 tets each
    double least_fill = 0.25;     // [-] share of a tet inside the surface from which it is kept
    double least_altitude = 0.75; // [-] of the undeformed tet's: fitting stops there. Lower fits closer and slows the step
    unsigned least_tets = 4;      // around a node: lighter ones are spikes on the surface, and go
    unsigned sweeps = 8;          // of fitting
};

struct LatticeMesh {
    TetMesh tets;
    double volume_ratio = 0.0; // [-] of the mesh to the surface's volume
    double farthest = 0.0;     // m, largest distance of a boundary node from the surface
    double fitted_share = 0.0; // [-] of the boundary nodes that lie on the surface
    std::size_t islands = 0;   // parts without a face in common with the largest one: dropped
    std::size_t island_tets = 0;
};

/// Cubes that give about so many boundary triangles.
[[nodiscard]] double find_lattice_cell(const TriMesh& surface, std::size_t triangles) noexcept;

/// surface: closed, outward. Fails with BadValue (cell not positive, or more than kMostLatticeCells in its box or
/// kMostLatticeTets in its volume) or BadMesh (no tet is filled enough: the body is thinner than a cell).
[[nodiscard]] Result<LatticeMesh> make_lattice_mesh(const TriMesh& surface, const LatticeOptions& options);

/// The lattice whose nodes come nearest to a number, over cells tried a few times: to compare with another mesh.
[[nodiscard]] Result<LatticeMesh> make_lattice_of_nodes(const TriMesh& surface, std::size_t nodes);

/// Of the surface's box: each costs two points and their distances from the surface, 64 bytes and some microseconds.
inline constexpr double kMostLatticeCells = 5e6;
inline constexpr double kMostLatticeTets = 5e6;

} // namespace trocar::fem
