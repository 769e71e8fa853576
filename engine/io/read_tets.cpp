#include "engine/io/read_tets.hpp"

#include "engine/io/file_bytes.hpp"
#include "engine/io/formats.hpp"
#include "engine/io/mesh_path.hpp"

#include <fmt/format.h>

namespace trocar::engine {
namespace {

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

Result<TetMesh> read_pair(const std::filesystem::path& node_path, const std::filesystem::path& ele_path, BesideTets* beside) {
    const Result<std::string> nodes = read_file_bytes(node_path);
    if (!nodes) return nodes.error();
    const Result<std::string> elements = read_file_bytes(ele_path);
    if (!elements) return elements.error();
    return parse_tetgen(*nodes, node_path.string(), *elements, ele_path.string(), beside);
}

Result<TetMesh> parse(const std::filesystem::path& path, const std::string& extension, BesideTets* beside) {
    const std::string name = path.string();
    const Result<std::string> bytes = read_file_bytes(path);
    if (!bytes) return bytes.error();
    if (bytes->empty()) return Error{ErrorCode::BadSyntax, "is empty", name};
    if (extension == ".msh") return parse_msh(*bytes, name, beside);
    if (extension == ".mesh") return parse_medit(*bytes, name, beside);
    if (extension == ".veg") return parse_veg(*bytes, name, beside);
    if (extension == ".vtk" || extension == ".vtu") {
        const bool with_data = beside != nullptr && beside->with_arrays;
        Result<VtkMesh> vtk = extension == ".vtk" ? parse_vtk_legacy(*bytes, name, with_data) : parse_vtk_xml(*bytes, name, with_data);
        if (!vtk) return vtk.error();
        return make_tets(std::move(*vtk), name, beside);
    }
    return Error{
        ErrorCode::BadUsage,
        fmt::format("'{}' is no tetrahedra format; .msh, .vtk, .vtu, .mesh, .node/.ele and .veg are read, each also with .gz", extension),
        name};
}

} // namespace

Result<TetMesh> read_tets(const std::filesystem::path& path, BesideTets* beside) {
    const std::string extension = mesh_extension(path);
    if (beside != nullptr) *beside = BesideTets{.faces = {}, .split = {}, .with_arrays = beside->with_arrays, .arrays = {}, .vectors = {}, .place_of_tet = {}, .place_of_node = {}, .cells = 0};
    Result<TetMesh> mesh = extension == ".node"  ? read_pair(path, partner(path, ".ele"), beside)
                           : extension == ".ele" ? read_pair(partner(path, ".node"), path, beside)
                                                 : parse(path, extension, beside);
    if (mesh && mesh->tets.empty()) return Error{ErrorCode::BadMesh, "holds cells, but none of four corners or more that differ", path.string()};
    return mesh;
}

} // namespace trocar::engine
