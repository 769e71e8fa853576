// Tetrahedra files: MSH (Gmsh 1, 2.x, 4.1), VTK legacy, VTU, MEDIT .mesh, TetGen .node/.ele, Vega .veg; plain or .gz.
#pragma once

#include "base/mesh.hpp"
#include "base/result.hpp"
#include "engine/io/split_cells.hpp"

#include <filesystem>

namespace trocar::engine {

/// Reads the linear tetrahedra of a file; coordinates are in the file's own unit. Hexahedra, prisms and pyramids are split
/// (join_cells); points, lines, triangles and cells of higher order are passed over; nodes keep the file's order, unreferenced ones included (see
/// drop_unreferenced_nodes). Of a TetGen pair either file may be named.
/// A file whose tetrahedra are all negative follows the other orientation convention and is turned round as a whole;
/// single inverted or flat tetrahedra are kept as they are for inspect_tets to name.
/// fails     with file and line (binary formats: byte offset): unknown extension or version, broken syntax, index out
///           of range, NaN or infinite coordinate, truncated, no cell with a volume at all (what it holds instead is named)
/// beside    where given: gets what else the file holds; its cell arrays where with_arrays is set
/// cost      O(file size); memory is bounded by the file's size, whatever counts it claims
[[nodiscard]] Result<TetMesh> read_tets(const std::filesystem::path& path, BesideTets* beside = nullptr);

} // namespace trocar::engine
