#include "engine/io/read_surface.hpp"

#include "base/topology.hpp"
#include "engine/io/file_bytes.hpp"
#include "engine/io/formats.hpp"
#include "engine/io/mesh_path.hpp"
#include "engine/io/weld.hpp"

#include <fmt/format.h>

namespace seldinger::engine {
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
    return Error{ErrorCode::BadUsage,
                 fmt::format("'{}' is no surface format; .obj, .ply, .stl, .off, .vtk and .vtp are read, each also with .gz", extension),
                 name};
}

} // namespace

Result<TriMesh> read_surface(const std::filesystem::path& path, const ReadOptions& options) {
    const std::string extension = mesh_extension(path), name = path.string();
    const Result<std::string> bytes = read_file_bytes(path);
    if (!bytes) return bytes.error();
    if (bytes->empty()) return Error{ErrorCode::BadSyntax, "is empty", name};
    Result<TriMesh> mesh = parse(*bytes, name, extension, options);
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

} // namespace seldinger::engine
