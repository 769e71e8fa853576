#include "engine/io/read_surface.hpp"

#include "base/topology.hpp"
#include "engine/io/file_bytes.hpp"
#include "engine/io/formats.hpp"
#include "engine/io/mesh_path.hpp"
#include "engine/io/read_tets.hpp"
#include "engine/io/weld.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace trocar::engine {
namespace {

/// From bytes to triangles, in the file's own vertices.
Result<TriMesh> parse(const std::string& bytes, const std::string& name, const std::string& extension, const ReadOptions& options) {
    if (extension == ".obj") {
        Result<GroupedSurface> grouped = parse_obj(bytes, name, options.groups);
        if (!grouped) return grouped.error();
        return std::move(grouped->mesh);
    }
    if (!options.groups.empty()) return Error{ErrorCode::BadValue, "groups can only be chosen from an OBJ file", name};
    if (extension == ".ply") return parse_ply(bytes, name);
    if (extension == ".stl") return parse_stl(bytes, name);
    if (extension == ".off") return parse_off(bytes, name);
    if (extension == ".vtk" || extension == ".vtp" || extension == ".vtu") {
        Result<VtkMesh> vtk = extension == ".vtk" ? parse_vtk_legacy(bytes, name) : parse_vtk_xml(bytes, name);
        if (!vtk) return vtk.error();
        return make_surface(std::move(*vtk), name);
    }
    return Error{
        ErrorCode::BadUsage,
        fmt::format("'{}' is no surface format; .obj, .ply, .stl, .off, .vtk and .vtp are read, and of tetrahedra (.msh, .vtk, .vtu, "
                    ".mesh, .node/.ele, .veg) the boundary, each also with .gz",
                    extension),
        name};
}

bool holds_tets_alone(const std::string& extension) {
    constexpr std::array kFormats = {".msh", ".mesh", ".veg", ".node", ".ele"};
    return std::find(kFormats.begin(), kFormats.end(), extension) != kFormats.end();
}

/// The faces of one tetrahedron alone.
Result<TriMesh> read_boundary(const std::filesystem::path& path, std::string* note) {
    const Result<TetMesh> tets = read_tets(path);
    if (!tets) return tets.error();
    TriMesh boundary = boundary_surface(*tets);
    drop_unreferenced_vertices(boundary);
    if (note != nullptr)
        *note = fmt::format("the boundary of {} tetrahedra; the tetrahedra themselves are taken by a body's \"coarse\": {{\"file\": ...}}",
                            tets->tets.size());
    if (boundary.triangles.empty()) return Error{ErrorCode::BadMesh, "holds tetrahedra without a boundary", path.string()};
    return boundary;
}

} // namespace

Result<TriMesh> read_surface(const std::filesystem::path& path, const ReadOptions& options, std::string* note) {
    const std::string extension = mesh_extension(path), name = path.string();
    if (holds_tets_alone(extension)) {
        if (!options.groups.empty()) return Error{ErrorCode::BadValue, "groups can only be chosen from an OBJ file", name};
        return read_boundary(path, note);
    }
    const Result<std::string> bytes = read_file_bytes(path);
    if (!bytes) return bytes.error();
    if (bytes->empty()) return Error{ErrorCode::BadSyntax, "is empty", name};
    Result<TriMesh> mesh = parse(*bytes, name, extension, options);
    if (!mesh && mesh.error().code == ErrorCode::BadMesh && (extension == ".vtk" || extension == ".vtu"))
        if (Result<TriMesh> boundary = read_boundary(path, note)) return boundary; // a grid without polygons
    if (!mesh) return mesh;
    if (options.weld || extension == ".stl") weld_equal_vertices(*mesh);
    if (options.weld || !options.groups.empty()) drop_unreferenced_vertices(*mesh);
    return mesh;
}

Result<std::vector<std::string>> read_surface_groups(const std::filesystem::path& path) {
    std::vector<std::string> names;
    if (mesh_extension(path) != ".obj") return names;
    const Result<std::string> bytes = read_file_bytes(path);
    if (!bytes) return bytes.error();
    const Result<GroupedSurface> grouped = parse_obj(*bytes, path.string(), {});
    if (!grouped) return grouped.error();
    names.assign(grouped->groups.begin(), grouped->groups.end());
    return names;
}

} // namespace trocar::engine
