// STL, text and binary. Vertices are welded by the caller: the format repeats them for every triangle.
#include "engine/io/formats.hpp"
#include "engine/io/scalar.hpp"
#include "engine/io/scanner.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

namespace trocar::engine {
namespace {

constexpr std::size_t kHeaderBytes = 80, kCountBytes = 4, kFacetBytes = 50, kNormalBytes = 12;

std::size_t binary_facets(std::string_view bytes) {
    return static_cast<std::size_t>(load_integer(bytes.data() + kHeaderBytes, ScalarType::UInt32, false));
}

/// Only the size tells for certain: binary headers, too, may begin with "solid".
bool has_binary_size(std::string_view bytes) {
    if (bytes.size() < kHeaderBytes + kCountBytes) return false;
    return bytes.size() == kHeaderBytes + kCountBytes + binary_facets(bytes) * kFacetBytes;
}

bool equal_word(std::string_view word, std::string_view lower) {
    return std::ranges::equal(word, lower, [](char a, char b) { return std::tolower(static_cast<unsigned char>(a)) == b; });
}

bool begins_with_solid(std::string_view bytes) { return equal_word(Scanner(bytes, {}).peek_word(), "solid"); }

Result<TriMesh> parse_binary(std::string_view bytes, const std::string& name) {
    Scanner in(bytes, name);
    in.set_binary(true);
    std::string_view part;
    if (!in.raw(part, kHeaderBytes + kCountBytes, "the header")) return in.error();
    const std::size_t facets = binary_facets(bytes);
    if (!in.check_fits(facets, kFacetBytes, "the number of triangles")) return in.error();
    TriMesh mesh;
    mesh.vertices.reserve(3 * facets);
    mesh.triangles.reserve(facets);
    for (std::size_t i = 0; i < facets; ++i) {
        if (!in.raw(part, kFacetBytes, "a triangle")) return in.error();
        const auto first = static_cast<Index>(mesh.vertices.size());
        for (std::size_t at = kNormalBytes; at < 4 * kNormalBytes; at += 12) {
            const char* p = part.data() + at;
            const Vec3 position(load_real(p, ScalarType::Float32, false), load_real(p + 4, ScalarType::Float32, false),
                                load_real(p + 8, ScalarType::Float32, false));
            if (!is_finite(position)) {
                in.fail_not_finite(mesh.vertices.size());
                return in.error();
            }
            mesh.vertices.push_back(position);
        }
        mesh.triangles.push_back({first, first + 1, first + 2});
    }
    return mesh;
}

/// facet normal x y z / outer loop / vertex x y z ... / endloop / endfacet
bool read_facet(Scanner& in, TriMesh& mesh, std::vector<Index>& corners) {
    in.skip_line(); // the normal: the corners' order says the same
    std::string_view word;
    if (!in.word(word, "'outer loop'")) return false;
    if (!equal_word(word, "outer")) return in.fail(ErrorCode::BadSyntax, "'outer loop' should stand here");
    in.skip_line();
    corners.clear();
    while (in.word(word, "'vertex' or 'endloop'") && equal_word(word, "vertex")) {
        Vec3 position;
        if (!in.point(position, mesh.vertices.size())) return false;
        corners.push_back(static_cast<Index>(mesh.vertices.size()));
        mesh.vertices.push_back(position);
    }
    if (in.failed()) return false;
    if (!equal_word(word, "endloop")) return in.fail(ErrorCode::BadSyntax, "'vertex' or 'endloop' should stand here");
    if (corners.size() < 3) return in.fail(ErrorCode::BadSyntax, fmt::format("a facet with {} vertices", corners.size()));
    add_fan(mesh.triangles, corners);
    if (!in.word(word, "'endfacet'")) return false;
    return equal_word(word, "endfacet") || in.fail(ErrorCode::BadSyntax, "'endfacet' should stand here");
}

Result<TriMesh> parse_text(std::string_view bytes, const std::string& name) {
    Scanner in(bytes, name);
    TriMesh mesh;
    std::vector<Index> corners;
    bool inside = false; // of a solid; a file may hold several
    std::string_view word;
    while (!in.at_end()) {
        if (!in.word(word, "a statement")) return in.error();
        const bool opens = equal_word(word, "solid");
        if (opens || equal_word(word, "endsolid")) {
            inside = opens;
            in.skip_line();
        } else if (!inside || !equal_word(word, "facet")) {
            in.fail(ErrorCode::BadSyntax, inside ? "'facet' or 'endsolid' should stand here" : "'solid' should stand here");
            return in.error();
        } else if (!read_facet(in, mesh, corners)) {
            return in.error();
        }
    }
    if (inside) return Error{ErrorCode::BadSyntax, "is cut off: 'endsolid' is missing", name};
    return mesh;
}

} // namespace

Result<TriMesh> parse_stl(std::string_view bytes, const std::string& name) {
    const bool text = !has_binary_size(bytes) && begins_with_solid(bytes);
    Result<TriMesh> mesh = text ? parse_text(bytes, name) : parse_binary(bytes, name);
    if (mesh && mesh->triangles.empty()) return Error{ErrorCode::BadMesh, "holds no triangle", name};
    return mesh;
}

} // namespace trocar::engine
