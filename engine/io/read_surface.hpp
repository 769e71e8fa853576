// Surface files: OBJ, PLY, STL, OFF, VTK legacy PolyData and VTP; of tetrahedra files the boundary, or their own closed triangles; plain or .gz.
#pragma once

#include "base/mesh.hpp"
#include "base/result.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace trocar::engine {

struct ReadOptions {
    /// OBJ only: keep the faces of these groups or objects (names after g and o), and the vertices they use.
    /// Empty keeps everything, vertices without a face included, in the file's order.
    std::vector<std::string> groups = {};
    /// Joins vertices with equal coordinates and drops those without a face. STL files, which repeat every vertex,
    /// are always welded.
    bool weld = false;
};

/// Reads a surface; coordinates are in the file's own unit. Polygons are split into fans from their first corner;
/// faces with fewer than three corners bound no area and are dropped. Normals, colours and textures are passed over.
/// Of a file that holds tetrahedra (see read_tets.hpp) the boundary is taken, or triangles that it lists beside them where those are a
/// closed surface of their own; *note says which.
/// No topology is checked (see inspect_surface), but every index is in range and every coordinate finite.
/// fails     with file and line (binary formats: byte offset): unknown extension, broken syntax, index out of range,
///           NaN or infinite coordinate, truncated, no triangle at all, unknown group (the known ones are listed)
/// cost      O(file size); memory is bounded by the file's size, whatever counts it claims
[[nodiscard]] Result<TriMesh> read_surface(const std::filesystem::path& path, const ReadOptions& options = {}, std::string* note = nullptr);

/// Names of the groups and objects of an OBJ that own at least one face, sorted. Other formats have none.
[[nodiscard]] Result<std::vector<std::string>> read_surface_groups(const std::filesystem::path& path);

} // namespace trocar::engine
