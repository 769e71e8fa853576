#include "engine/prepare/coarse.hpp"

#include "base/simplify.hpp"
#include "base/topology.hpp"
#include "engine/io/weld.hpp"
#include "engine/prepare/cache.hpp"

#include <fmt/format.h>

#include <cmath>

namespace seldinger::engine {

namespace {

/// Raised whenever the same input would give another mesh: part of every key.
constexpr std::string_view kVersion = "coarse-1";
constexpr std::string_view kKind = "coarse";
constexpr std::size_t kLeastTriangles = 20;
constexpr int kAttempts = 3; // each with half as many triangles again

std::string find_key(const TriMesh& dense, const CoarseOptions& o) {
    ContentHash hash;
    hash.feed(kVersion);
    hash.feed(dense);
    hash.feed(static_cast<std::uint64_t>(o.surface_triangles));
    for (const double value : {o.tetgen.max_radius_edge_ratio, o.tetgen.min_dihedral_degrees, o.tetgen.max_volume}) hash.feed(value);
    hash.feed(static_cast<std::uint64_t>(o.tetgen.keep_surface));
    hash.feed(o.tetgen.program);
    return hash.hex();
}

/// Twice the regular tet on the surface's mean triangle: inside tets about as large as those at the surface.
double derive_max_volume(const TriMesh& surface) {
    double area = 0.0;
    for (const Triangle& t : surface.triangles)
        area += 0.5 * (surface.vertices[t[1]] - surface.vertices[t[0]]).cross(surface.vertices[t[2]] - surface.vertices[t[0]]).norm();
    const double edge = std::sqrt(4.0 / std::sqrt(3.0) * area / static_cast<double>(surface.triangles.size()));
    return 2.0 * edge * edge * edge / (6.0 * std::sqrt(2.0));
}

Result<TetMesh> simplify_and_mesh(const TriMesh& dense, std::size_t triangles, TetgenOptions options) {
    const Result<TriMesh> simple = simplify(dense, triangles);
    if (!simple) return simple.error();
    if (options.max_volume == 0.0) options.max_volume = derive_max_volume(*simple);
    return run_tetgen(*simple, options);
}

/// Only a finer surface can help against these; a missing program or a bad option stays what it is.
bool worth_another_try(const Error& error) { return error.code == ErrorCode::BadMesh || error.code == ErrorCode::ToolFailed; }

Result<TetMesh> mesh_with_retries(const TriMesh& dense, const CoarseOptions& options) {
    std::size_t triangles = options.surface_triangles;
    for (int attempt = 1;; ++attempt) {
        Result<TetMesh> mesh = simplify_and_mesh(dense, triangles, options.tetgen);
        if (mesh || attempt == kAttempts || !worth_another_try(mesh.error())) return mesh;
        triangles += triangles / 2;
    }
}

} // namespace

Result<CoarseMesh> make_coarse_mesh(const TriMesh& dense, const CoarseOptions& options) {
    if (options.surface_triangles < kLeastTriangles)
        return Error{.code = ErrorCode::BadValue,
                     .message = fmt::format("{} coarse surface triangles; at least {} enclose an organ", options.surface_triangles, kLeastTriangles)};
    CoarseMesh coarse;
    const std::string key = find_key(dense, options);
    if (options.use_cache) {
        if (const auto payload = read_cache(kKind, key)) {
            if (auto mesh = unpack_tets(*payload)) {
                coarse.tets = std::move(*mesh);
                coarse.from_cache = true;
            }
        }
    }
    if (!coarse.from_cache) {
        if (const auto closed = check_closed_surface(dense); !closed) return closed.error();
        Result<TetMesh> mesh = mesh_with_retries(dense, options);
        if (!mesh) return mesh.error();
        coarse.tets = std::move(mesh).value();
        if (options.use_cache) write_cache(kKind, key, pack_mesh(coarse.tets));
    }
    coarse.surface_triangles = boundary_surface(coarse.tets).triangles.size();
    return coarse;
}

std::size_t drop_unused_nodes(TetMesh& mesh) { return drop_unreferenced_nodes(mesh); }

} // namespace seldinger::engine
