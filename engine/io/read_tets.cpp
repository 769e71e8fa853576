#include "engine/io/read_tets.hpp"

#include "engine/io/file_bytes.hpp"
#include "engine/io/formats.hpp"
#include "engine/io/mesh_path.hpp"

#include <Eigen/Geometry>
#include <fmt/format.h>

#include <algorithm>

namespace trocar::engine {
namespace {

/// Turns all tetrahedra round where not one is positive: then the file counts the other way.
void follow_convention(TetMesh& mesh) {
    bool any_negative = false;
    for (const Tet& t : mesh.tets) {
        const Vec3& origin = mesh.vertices[t[0]];
        const Vec3 a = mesh.vertices[t[1]] - origin, b = mesh.vertices[t[2]] - origin, c = mesh.vertices[t[3]] - origin;
        const double volume = a.dot(b.cross(c));
        if (volume > 0) return;
        any_negative = any_negative || volume < 0;
    }
    if (any_negative)
        for (Tet& t : mesh.tets) std::swap(t[2], t[3]);
}

/// "x.1.node" beside "x.1.ele", packed or not.
std::filesystem::path partner(const std::filesystem::path& path, const std::string& extension) {
    const bool packed = path.extension() == ".gz";
    std::filesystem::path stem = packed ? path.stem() : path;
    stem.replace_extension(extension);
    std::filesystem::path plain = path.parent_path() / stem.filename(), gz = plain;
    gz += ".gz";
    std::error_code ignored;
    const std::filesystem::path& first = packed ? gz : plain;
    const std::filesystem::path& second = packed ? plain : gz;
    return std::filesystem::exists(first, ignored) || !std::filesystem::exists(second, ignored) ? first : second;
}

Result<TetMesh> read_pair(const std::filesystem::path& node_path, const std::filesystem::path& ele_path) {
    const Result<std::string> nodes = read_file_bytes(node_path);
    if (!nodes) return nodes.error();
    const Result<std::string> elements = read_file_bytes(ele_path);
    if (!elements) return elements.error();
    return parse_tetgen(*nodes, node_path.string(), *elements, ele_path.string());
}

Result<TetMesh> parse(const std::filesystem::path& path, const std::string& extension, std::vector<Triangle>* faces) {
    const std::string name = path.string();
    const Result<std::string> bytes = read_file_bytes(path);
    if (!bytes) return bytes.error();
    if (bytes->empty()) return Error{ErrorCode::BadSyntax, "is empty", name};
    if (extension == ".msh") return parse_msh(*bytes, name, faces);
    if (extension == ".mesh") return parse_medit(*bytes, name, faces);
    if (extension == ".veg") return parse_veg(*bytes, name);
    if (extension == ".vtk" || extension == ".vtu") {
        Result<VtkMesh> vtk = extension == ".vtk" ? parse_vtk_legacy(*bytes, name) : parse_vtk_xml(*bytes, name);
        if (!vtk) return vtk.error();
        return make_tets(std::move(*vtk), name);
    }
    return Error{
        ErrorCode::BadUsage,
        fmt::format("'{}' is no tetrahedra format; .msh, .vtk, .vtu, .mesh, .node/.ele and .veg are read, each also with .gz", extension),
        name};
}

} // namespace

Result<TetMesh> read_tets(const std::filesystem::path& path, std::vector<Triangle>* faces) {
    const std::string extension = mesh_extension(path);
    Result<TetMesh> mesh = extension == ".node"  ? read_pair(path, partner(path, ".ele"))
                           : extension == ".ele" ? read_pair(partner(path, ".node"), path)
                                                 : parse(path, extension, faces);
    if (mesh) follow_convention(*mesh);
    return mesh;
}

} // namespace trocar::engine
