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
#include <optional>
#include <utility>

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

/// Corners in ascending order, triangles too.
std::vector<Triangle> sorted_corners(std::vector<Triangle> triangles) {
    for (Triangle& t : triangles) std::sort(t.begin(), t.end());
    std::sort(triangles.begin(), triangles.end());
    return triangles;
}

/// Triangles that a file lists beside its tetrahedra, outward, where they are a closed surface.
std::optional<TriMesh> find_closed(const TetMesh& tets, std::vector<Triangle> faces) {
    TriMesh mesh{tets.vertices, std::move(faces)};
    const SurfaceReport report = inspect_surface(mesh);
    if (!report.closed() || !report.manifold() || !report.oriented() || report.signed_volume == 0.0) return std::nullopt;
    if (report.signed_volume < 0.0)
        for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
    return mesh;
}

/// The surface of a file of tetrahedra: the triangles that it lists beside them, where those are closed and another surface than
/// the boundary (a mesh of the hull around an organ); else the faces of one tetrahedron alone.
Result<TriMesh> read_boundary(const std::filesystem::path& path, std::string* note) {
    BesideTets beside;
    const Result<TetMesh> tets = read_tets(path, &beside);
    if (!tets) return tets.error();
    TriMesh surface = boundary_surface(*tets);
    std::vector<Triangle>& faces = beside.faces;
    const std::size_t listed = faces.size();
    const auto boundary = sorted_corners(surface.triangles), own = sorted_corners(faces);
    const bool others = !std::includes(boundary.begin(), boundary.end(), own.begin(), own.end());
    auto closed = others ? find_closed(*tets, std::move(faces)) : std::nullopt;
    std::string what = fmt::format("the boundary of {} tetrahedra{}", tets->tets.size(),
                                   others ? fmt::format(" (the file's own {} triangles were left aside: they are no closed surface)", listed)
                                          : std::string());
    if (closed) {
        what = fmt::format("the file's own {} triangles, a closed surface, and not the boundary of its {} tetrahedra ({} triangles)", listed,
                           tets->tets.size(), surface.triangles.size());
        surface = std::move(*closed);
    }
    drop_unreferenced_vertices(surface);
    if (note != nullptr) *note = what + "; the tetrahedra themselves are taken by a body's \"coarse\": {\"file\": ...}";
    if (surface.triangles.empty()) return Error{ErrorCode::BadMesh, "holds tetrahedra without a boundary", path.string()};
    return surface;
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
