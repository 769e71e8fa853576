// The file formats, one parser each, on bytes in memory. name is only for messages. What read_surface and read_tets
// promise about errors, memory and time holds for each of them.
#pragma once

#include "base/mesh.hpp"
#include "base/result.hpp"
#include "engine/io/split_cells.hpp"

#include <cstddef>
#include <cstdint>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace trocar::engine {

/// A surface together with the names of the groups and objects that own at least one face (OBJ only).
struct GroupedSurface {
    TriMesh mesh;
    std::set<std::string> groups;
};

/// keep empty: all groups. Vertices are those of the whole file.
[[nodiscard]] Result<GroupedSurface> parse_obj(std::string_view bytes, const std::string& name, std::span<const std::string> keep);
[[nodiscard]] Result<TriMesh> parse_off(std::string_view bytes, const std::string& name);
[[nodiscard]] Result<TriMesh> parse_ply(std::string_view bytes, const std::string& name);
[[nodiscard]] Result<TriMesh> parse_stl(std::string_view bytes, const std::string& name);

/// beside  where given: gets what else the file holds, cell arrays where it asks for them
[[nodiscard]] Result<TetMesh> parse_msh(std::string_view bytes, const std::string& name, BesideTets* beside = nullptr);
[[nodiscard]] Result<TetMesh> parse_medit(std::string_view bytes, const std::string& name, BesideTets* beside = nullptr);
[[nodiscard]] Result<TetMesh> parse_veg(std::string_view bytes, const std::string& name, BesideTets* beside = nullptr);
[[nodiscard]] Result<TetMesh> parse_tetgen(std::string_view node_bytes, const std::string& node_name, std::string_view ele_bytes,
                                           const std::string& ele_name, BesideTets* beside = nullptr);

/// Polygons and cells of a VTK file (legacy or XML), before it is known whether surface or volume is wanted.
struct VtkCells {
    std::vector<std::int64_t> ends;         // [cell_count] end of each cell in connectivity, non-decreasing
    std::vector<std::int64_t> connectivity; // point ids
    std::vector<std::uint8_t> types;        // [cell_count] of an unstructured grid, else empty
};
struct VtkMesh {
    std::vector<Vec3> points;
    VtkCells polygons, strips; // of PolyData
    VtkCells cells;            // of an unstructured grid
    bool unstructured = false;
    VtkCells lines;                                                 // of PolyData, where they are asked for
    std::vector<std::pair<std::string, std::vector<double>>> of_points, of_cells; // arrays of one component, where they are asked for
    std::vector<std::pair<std::string, std::vector<double>>> vectors_of_cells;    // of three, one cell after another
};
/// with_data  arrays of the cells are wanted as well
[[nodiscard]] Result<VtkMesh> parse_vtk_legacy(std::string_view bytes, const std::string& name, bool with_data = false);
/// with_data  arrays are wanted as well: of an unstructured grid those of the cells, of PolyData both kinds, and the lines
[[nodiscard]] Result<VtkMesh> parse_vtk_xml(std::string_view bytes, const std::string& name, bool with_data = false);

/// Polygons, strips and triangle cells as one surface; fails where an id is out of range.
[[nodiscard]] Result<TriMesh> make_surface(VtkMesh&& vtk, const std::string& name);
/// Linear cells of an unstructured grid.
[[nodiscard]] Result<TetMesh> make_tets(VtkMesh&& vtk, const std::string& name, BesideTets* beside = nullptr);

/// Splits a polygon into a fan from its first corner; fewer than three corners give nothing.
inline void add_fan(std::vector<Triangle>& triangles, std::span<const Index> corners) {
    for (std::size_t i = 2; i < corners.size(); ++i) triangles.push_back({corners[0], corners[i - 1], corners[i]});
}

} // namespace trocar::engine
