#include "engine/prepare/coarse.hpp"

#include "base/simplify.hpp"
#include "base/topology.hpp"
#include "engine/io/weld.hpp"
#include "engine/prepare/cache.hpp"
#include "engine/prepare/process.hpp"
#include "engine/time/interrupt.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <limits>
#include <optional>

namespace trocar::engine {

namespace {

constexpr std::string_view kKind = "coarse";
constexpr std::size_t kLeastTriangles = 20;
constexpr double kShares[] = {1.0, 1.25, 0.8, 1.5, 0.65}; // of the triangles asked for, in this order
constexpr double kSliver = 0.05;                          // [-] flatness below which a tet is dropped
constexpr std::size_t kMostSlivers = 25;                  // at most one tet of so many
constexpr double kRoundEnough = 0.06;                     // [-] flatness at which no further try is made

/// Which TetGen: another one, or another version at the same place, makes another mesh. The name alone where there is none.
void feed_program(ContentHash& hash, const std::string& name) {
    hash.feed(name);
    const auto program = find_program(name, "tetgen");
    if (!program) return;
    std::error_code ignored;
    hash.feed(program->string());
    hash.feed(static_cast<std::uint64_t>(std::filesystem::file_size(*program, ignored)));
    hash.feed(static_cast<std::uint64_t>(std::filesystem::last_write_time(*program, ignored).time_since_epoch().count()));
}

std::string find_key(const TriMesh& dense, const CoarseOptions& o) {
    ContentHash hash;
    hash.feed(maker_version());
    hash.feed(dense);
    hash.feed(static_cast<std::uint64_t>(o.surface_triangles));
    for (const double value : {o.tetgen.max_radius_edge_ratio, o.tetgen.min_dihedral_degrees, o.tetgen.max_volume}) hash.feed(value);
    hash.feed(static_cast<std::uint64_t>(o.tetgen.keep_surface));
    feed_program(hash, o.tetgen.program);
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

/// timed_out  set where TetGen was stopped at its time limit
Result<TetMesh> simplify_and_mesh(const TriMesh& dense, std::size_t triangles, TetgenOptions options, bool& timed_out) {
    const Result<TriMesh> simple = simplify(dense, triangles);
    if (!simple) return simple.error();
    if (options.max_volume == 0.0) options.max_volume = derive_max_volume(*simple);
    return run_tetgen(*simple, options, &timed_out);
}

/// Try number `tries` reached its time limit.
Error out_of_time(const Error& last, const CoarseOptions& options, std::size_t tries) {
    return {.code = ErrorCode::ToolFailed,
            .message = fmt::format("TetGen made no mesh within {:g} s, the time limit of each try (try {} of at most {}); a surface "
                                   "with fewer triangles takes less, \"mesher\": \"lattice\" takes none; the try: {}",
                                   options.tetgen.time_limit, tries, std::size(kShares), last.message)};
}

/// Another surface can help only against these, not against a missing program or a bad option.
bool worth_another_try(const Error& error) { return error.code == ErrorCode::BadMesh || error.code == ErrorCode::ToolFailed; }

double least_altitude(const TetMesh& mesh, const Tet& t) {
    const Vec3& o = mesh.vertices[t[0]];
    const Vec3 a = mesh.vertices[t[1]] - o, b = mesh.vertices[t[2]] - o, c = mesh.vertices[t[3]] - o;
    const double largest_face_sq =
        std::max({a.cross(b).squaredNorm(), a.cross(c).squaredNorm(), b.cross(c).squaredNorm(), (b - a).cross(c - a).squaredNorm()});
    return a.dot(b.cross(c)) / std::sqrt(largest_face_sq);
}

double find_least_altitude(const TetMesh& mesh) {
    double least = std::numeric_limits<double>::infinity();
    for (const Tet& t : mesh.tets) least = std::min(least, least_altitude(mesh, t));
    return least;
}

/// Flattest tet's least altitude over the mean edge. The stable step is in proportion: one sliver slows the whole body.
/// 0.82 for regular tets.
double find_flatness(const TetMesh& mesh) {
    double edges = 0.0;
    for (const Tet& t : mesh.tets)
        for (std::size_t i = 0; i < 4; ++i)
            for (std::size_t j = i + 1; j < 4; ++j) edges += (mesh.vertices[t[i]] - mesh.vertices[t[j]]).norm() / 6.0;
    return find_least_altitude(mesh) * static_cast<double>(mesh.tets.size()) / edges;
}

/// Other counts until no tet is flat; the roundest try wins where all have one. A try that runs out of time ends them with an error,
/// also where an earlier one gave a mesh: else the mesh would depend on the machine's speed.
Result<TetMesh> mesh_with_retries(const TriMesh& dense, const CoarseOptions& options) {
    std::optional<Result<TetMesh>> best;
    double best_flatness = -1.0;
    std::size_t tries = 0;
    for (const double share : kShares) {
        const auto wanted = static_cast<std::size_t>(share * static_cast<double>(options.surface_triangles));
        bool timed_out = false;
        Result<TetMesh> mesh = simplify_and_mesh(dense, std::max(wanted, kLeastTriangles), options.tetgen, timed_out);
        ++tries;
        if (!mesh && (interrupt_requested() || !worth_another_try(mesh.error()))) return mesh;
        if (timed_out) return out_of_time(mesh.error(), options, tries);
        const double flatness = mesh ? find_flatness(*mesh) : -1.0;
        if (!best || flatness > best_flatness) {
            best_flatness = flatness;
            best.emplace(std::move(mesh));
        }
        if (best_flatness >= kRoundEnough) break;
    }
    if (!*best && best->error().code == ErrorCode::BadMesh) {
        Error error = best->error();
        error.message += fmt::format("; what helps: \"mesher\": \"lattice\", which takes any closed surface, or other \"surface_triangles\" "
                                     "than {} (TetGen meshes the surface after it is simplified to about so many)",
                                     options.surface_triangles);
        return error;
    }
    return std::move(*best);
}

/// Drops flat tets, the flattest first, up to one of kMostSlivers: wedges between sheets of the surface that almost touch.
/// They hold next to no volume, and the step of the whole body would follow them. Returns how many went.
std::size_t drop_slivers(TetMesh& mesh) {
    const double flattest = find_flatness(mesh);
    if (flattest >= kSliver) return 0;
    const double least_allowed = kSliver * find_least_altitude(mesh) / flattest; // of the mean edge
    std::vector<std::pair<double, std::size_t>> flat;                            // altitude, tet
    for (std::size_t i = 0; i < mesh.tets.size(); ++i)
        if (const double altitude = least_altitude(mesh, mesh.tets[i]); altitude < least_allowed) flat.emplace_back(altitude, i);
    std::sort(flat.begin(), flat.end());
    flat.resize(std::min(flat.size(), mesh.tets.size() / kMostSlivers));
    std::vector<bool> dropped(mesh.tets.size(), false);
    for (const auto& [altitude, i] : flat) dropped[i] = true;
    std::size_t kept = 0;
    for (std::size_t i = 0; i < mesh.tets.size(); ++i)
        if (!dropped[i]) mesh.tets[kept++] = mesh.tets[i];
    const std::size_t count = mesh.tets.size() - kept;
    mesh.tets.resize(kept);
    drop_unused_nodes(mesh);
    return count;
}

} // namespace

Result<CoarseMesh> make_coarse_mesh(const TriMesh& dense, const CoarseOptions& options) {
    if (options.surface_triangles < kLeastTriangles)
        return Error{.code = ErrorCode::BadValue,
                     .message = fmt::format("{} coarse surface triangles; at least {} enclose an organ", options.surface_triangles,
                                            kLeastTriangles)};
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
        drop_slivers(coarse.tets);
        if (options.use_cache) write_cache(kKind, key, pack_mesh(coarse.tets));
    }
    coarse.surface_triangles = boundary_surface(coarse.tets).triangles.size();
    return coarse;
}

std::size_t drop_unused_nodes(TetMesh& mesh) { return drop_unreferenced_nodes(mesh); }

} // namespace trocar::engine
