// OFF and its variants with colours or normals (COFF, NOFF, STOFF), text only.
#include "engine/io/formats.hpp"
#include "engine/io/scanner.hpp"

#include <fmt/format.h>

namespace trocar::engine {
namespace {

constexpr std::size_t kVertexBytes = 6; // "0 0 0\n"
constexpr std::size_t kFaceBytes = 2;   // "0\n"

bool read_header(Scanner& in, std::size_t& vertices, std::size_t& faces) {
    const std::string_view first = in.peek_word();
    if (first.ends_with("OFF")) {
        std::string_view keyword;
        if (!in.word(keyword, "OFF")) return false;
        if (keyword.find('4') != keyword.npos || keyword.find('n') != keyword.npos)
            return in.fail(ErrorCode::BadSyntax, fmt::format("'{}' is not a surface in space", keyword));
        if (in.peek_word() == "BINARY") return in.fail(ErrorCode::BadSyntax, "binary OFF is not read; write it as text");
    } else if (first.empty() || first[0] < '0' || first[0] > '9') {
        return in.fail(ErrorCode::BadSyntax, "does not begin with OFF");
    }
    if (!in.count(vertices, "the number of vertices", kVertexBytes) || !in.count(faces, "the number of faces", kFaceBytes)) return false;
    in.skip_line(); // the number of edges, not used
    return true;
}

bool read_face(Scanner& in, std::vector<Index>& corners, std::size_t vertex_count) {
    std::size_t size = 0;
    if (!in.count(size, "the number of corners", 2)) return false;
    corners.clear();
    for (std::size_t i = 0; i < size; ++i) {
        std::int64_t id = 0;
        if (!in.integer(id, "a vertex index")) return false;
        if (id < 0 || static_cast<std::size_t>(id) >= vertex_count)
            return in.fail(ErrorCode::BadMesh, fmt::format("vertex index {}, but there are {} vertices", id, vertex_count));
        corners.push_back(static_cast<Index>(id));
    }
    in.skip_line(); // colours
    return true;
}

} // namespace

Result<TriMesh> parse_off(std::string_view bytes, const std::string& name) {
    Scanner in(bytes, name);
    in.set_comment('#');
    std::size_t vertices = 0, faces = 0;
    if (!read_header(in, vertices, faces)) return in.error();
    if (vertices >= kNoIndex) return Error{ErrorCode::BadMesh, "more vertices than indices", name};
    TriMesh mesh;
    mesh.vertices.resize(vertices);
    for (std::size_t i = 0; i < vertices; ++i) {
        if (!in.point(mesh.vertices[i], i)) return in.error();
        in.skip_line(); // normals and colours
    }
    std::vector<Index> corners;
    for (std::size_t i = 0; i < faces; ++i) {
        if (!read_face(in, corners, vertices)) return in.error();
        add_fan(mesh.triangles, corners);
    }
    if (mesh.triangles.empty()) return Error{ErrorCode::BadMesh, "holds no face", name};
    return mesh;
}

} // namespace trocar::engine
