// Hexahedra, prisms and pyramids as tetrahedra that fit one another: every face with four corners is cut through its lowest node id, on both
// of its sides.
// source   Dompierre, Labbe, Vallet, Camarero 1999, How to subdivide pyramids, prisms and hexahedra into tetrahedra. Deviates: a hexahedron
//          becomes six tetrahedra always, all around its lowest node; their table finds five for some.
#pragma once

#include "base/mesh.hpp"
#include "engine/io/cell_arrays.hpp"

#include <array>
#include <cstddef>
#include <string>
#include <vector>

namespace trocar::engine {

/// Linear cells of a file beside its tetrahedra, in VTK's and Gmsh's order of corners.
struct MixedCells {
    std::vector<std::array<Index, 8>> hexahedra; // four of one side round, then those across from them
    std::vector<std::array<Index, 6>> prisms;    // three of one end, then those across from them
    std::vector<std::array<Index, 5>> pyramids;  // four of the base round, then the apex
    CellPlaces places;                           // of these and of the tetrahedra

    [[nodiscard]] bool empty() const noexcept { return hexahedra.empty() && prisms.empty() && pyramids.empty(); }
};

/// What was split, and what became of it.
struct SplitCells {
    std::size_t hexahedra = 0, prisms = 0, pyramids = 0, tets = 0;
};

/// What a file held beside linear tetrahedra.
struct BesideTets {
    std::vector<Triangle> faces; // that an MSH or MEDIT file lists, in the mesh's vertices
    SplitCells split;
    bool with_arrays = false;               // in: the three below are wanted
    std::vector<CellArray> arrays, vectors; // of the cells as the file has them: of one number each, of three
    std::vector<std::size_t> place_of_tet;  // [tet_count] of its values in them
    std::vector<Index> place_of_node;       // of every node of the file, kNoIndex: no tetrahedron has it; empty: all stay as they are
    std::size_t cells = 0;                  // of the file, VTK's; 0: its arrays have values for the cells alone that are read
};

/// A file's tetrahedra, then those of its other cells. Each kind follows one convention of orientation: where not one cell of a kind has a
/// positive volume all of them are turned round; single inverted ones are kept for inspect_tets to name. Cells whose corners coincide give
/// fewer tetrahedra.
/// tets    whose vertices are the corners of the cells, too
/// beside  where given: gets what was split, and the place of every tetrahedron's cell where the cells have one
[[nodiscard]] TetMesh join_cells(TetMesh&& tets, const MixedCells& cells, BesideTets* beside);

/// "2 hexahedra, 1 prism split into 15 tetrahedra"; empty where nothing was.
[[nodiscard]] std::string describe_split(const SplitCells& split);

} // namespace trocar::engine
