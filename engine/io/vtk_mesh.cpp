// From VTK's cells to our meshes.
#include "engine/io/formats.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>

namespace trocar::engine {
namespace {

// Cell types, from vtkCellType.h.
constexpr std::uint8_t kVtkTriangle = 5, kVtkStrip = 6, kVtkPolygon = 7, kVtkQuad = 9;
constexpr std::uint8_t kVtkTetrahedron = 10, kVtkVoxel = 11, kVtkHexahedron = 12, kVtkWedge = 13, kVtkPyramid = 14;

/// The corners of one cell, checked. Takes the cells one after the other.
class CellWalk {
public:
    CellWalk(const VtkCells& cells, std::size_t point_count) : cells_(cells), point_count_(point_count) {}

    bool next() {
        if (cell_ + 1 > cells_.ends.size()) return false;
        const std::int64_t end = cells_.ends[cell_];
        if (end < begin_ || static_cast<std::size_t>(end) > cells_.connectivity.size())
            return fail(fmt::format("cell {} ends at offset {} of {}", cell_, end, cells_.connectivity.size()));
        corners_.clear();
        for (; begin_ < end; ++begin_) {
            const std::int64_t id = cells_.connectivity[static_cast<std::size_t>(begin_)];
            if (id < 0 || static_cast<std::size_t>(id) >= point_count_)
                return fail(fmt::format("cell {} uses point {}, but there are {} points", cell_, id, point_count_));
            corners_.push_back(static_cast<Index>(id));
        }
        ++cell_;
        return true;
    }
    [[nodiscard]] const std::vector<Index>& corners() const { return corners_; }
    [[nodiscard]] std::size_t cell() const { return cell_ - 1; }
    [[nodiscard]] const std::optional<std::string>& problem() const { return problem_; }

private:
    bool fail(std::string message) {
        problem_ = std::move(message);
        return false;
    }

    const VtkCells& cells_;
    std::size_t point_count_, cell_ = 0;
    std::int64_t begin_ = 0;
    std::vector<Index> corners_;
    std::optional<std::string> problem_;
};

/// Every other triangle of a strip is turned round.
void add_strip(std::vector<Triangle>& triangles, const std::vector<Index>& corners) {
    for (std::size_t i = 2; i < corners.size(); ++i) {
        const bool even = i % 2 == 0;
        triangles.push_back({corners[i - 2], even ? corners[i - 1] : corners[i], even ? corners[i] : corners[i - 1]});
    }
}

bool add_cell(std::vector<Triangle>& triangles, const std::vector<Index>& corners, std::uint8_t type) {
    if (type == kVtkStrip)
        add_strip(triangles, corners);
    else if (type == kVtkTriangle || type == kVtkQuad || type == kVtkPolygon)
        add_fan(triangles, corners);
    else
        return false;
    return true;
}

/// 0: not taken.
std::size_t corners_of(std::uint8_t type) {
    switch (type) {
    case kVtkTetrahedron: return 4;
    case kVtkPyramid: return 5;
    case kVtkWedge: return 6;
    case kVtkVoxel:
    case kVtkHexahedron: return 8;
    default: return 0;
    }
}

/// Of a type that is taken.
std::vector<std::size_t>& places_of(std::uint8_t type, CellPlaces& places) {
    switch (type) {
    case kVtkTetrahedron: return places.tets;
    case kVtkPyramid: return places.pyramids;
    case kVtkWedge: return places.prisms;
    default: return places.hexahedra;
    }
}

Error bad_mesh(std::string message, const std::string& name) { return {ErrorCode::BadMesh, std::move(message), name}; }

std::optional<Error> check_types(const VtkCells& cells, const std::string& name) {
    if (cells.types.size() == cells.ends.size()) return std::nullopt;
    return bad_mesh(fmt::format("has {} cells but {} cell types", cells.ends.size(), cells.types.size()), name);
}

} // namespace

Result<TriMesh> make_surface(VtkMesh&& vtk, const std::string& name) {
    TriMesh mesh;
    std::size_t others = 0;
    if (vtk.unstructured)
        if (const auto error = check_types(vtk.cells, name)) return *error;
    const std::array<const VtkCells*, 3> lists = {&vtk.polygons, &vtk.strips, &vtk.cells};
    for (const VtkCells* list : lists) {
        CellWalk walk(*list, vtk.points.size());
        const std::uint8_t own_type = list == &vtk.strips ? kVtkStrip : kVtkPolygon;
        while (walk.next()) {
            const std::uint8_t type = list == &vtk.cells ? list->types[walk.cell()] : own_type;
            if (!add_cell(mesh.triangles, walk.corners(), type)) ++others;
        }
        if (walk.problem()) return bad_mesh(*walk.problem(), name);
    }
    if (mesh.triangles.empty()) return bad_mesh(fmt::format("holds no polygon; {} cells of other types", others), name);
    mesh.vertices = std::move(vtk.points);
    return mesh;
}

Result<TetMesh> make_tets(VtkMesh&& vtk, const std::string& name, BesideTets* beside) {
    if (!vtk.unstructured) return bad_mesh("is a surface (PolyData); tetrahedra need an unstructured grid", name);
    if (const auto error = check_types(vtk.cells, name)) return *error;
    TetMesh mesh;
    MixedCells cells;
    const bool with_arrays = beside != nullptr && beside->with_arrays;
    std::size_t others = 0;
    CellWalk walk(vtk.cells, vtk.points.size());
    while (walk.next()) {
        const std::vector<Index>& c = walk.corners();
        const std::uint8_t type = vtk.cells.types[walk.cell()];
        const std::size_t expected = corners_of(type);
        if (expected == 0) {
            ++others;
            continue;
        }
        if (c.size() != expected) return bad_mesh(fmt::format("cell {} of type {} has {} corners, expected {}", walk.cell(), type, c.size(), expected), name);
        if (with_arrays) places_of(type, cells.places).push_back(walk.cell());
        if (type == kVtkTetrahedron) mesh.tets.push_back({c[0], c[1], c[2], c[3]});
        if (type == kVtkHexahedron) cells.hexahedra.push_back({c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7]});
        if (type == kVtkVoxel) cells.hexahedra.push_back({c[0], c[1], c[3], c[2], c[4], c[5], c[7], c[6]});
        if (type == kVtkWedge) cells.prisms.push_back({c[0], c[1], c[2], c[3], c[4], c[5]});
        if (type == kVtkPyramid) cells.pyramids.push_back({c[0], c[1], c[2], c[3], c[4]});
    }
    if (walk.problem()) return bad_mesh(*walk.problem(), name);
    if (mesh.tets.empty() && cells.empty())
        return bad_mesh(fmt::format("holds no linear tetrahedra, hexahedra, prisms or pyramids; {} cells of other types", others), name);
    mesh.vertices = std::move(vtk.points);
    if (with_arrays) {
        beside->cells = vtk.cells.types.size();
        for (auto& [array, values] : vtk.of_cells) beside->arrays.push_back({std::move(array), std::move(values), {}});
        for (auto& [array, values] : vtk.vectors_of_cells) beside->vectors.push_back({std::move(array), std::move(values), {}});
    }
    return join_cells(std::move(mesh), cells, beside);
}

} // namespace trocar::engine
