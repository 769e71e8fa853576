#include "engine/prepare/tetgen.hpp"

#include "base/topology.hpp"
#include "engine/io/atomic_file.hpp"
#include "engine/io/read_tets.hpp"
#include "engine/prepare/process.hpp"

#include <fmt/format.h>

#include <cmath>

namespace trocar::engine {

namespace {

constexpr std::size_t kNamedPairs = 4; // crossing pairs that a message names

/// TetGen is given the surface in a unit box around the origin, the scale of its tolerances.
struct UnitFrame {
    Vec3 centre;
    double size;
    explicit UnitFrame(const TriMesh& surface) : centre(surface.bounds().centre()), size(surface.bounds().longest_edge()) {}
    [[nodiscard]] Vec3 to_unit(const Vec3& p) const { return (p - centre) / size; }
    [[nodiscard]] Vec3 from_unit(const Vec3& p) const { return centre + size * p; }
};

Result<void> check_options(const TetgenOptions& o) {
    const auto bad = [](std::string message) { return Error{.code = ErrorCode::BadValue, .message = std::move(message)}; };
    if (!(o.max_radius_edge_ratio >= 1.1 && o.max_radius_edge_ratio <= 100.0))
        return bad(fmt::format("the radius-edge ratio is {}; it must be in [1.1, 100]", o.max_radius_edge_ratio));
    if (!(o.min_dihedral_degrees >= 0.0 && o.min_dihedral_degrees <= 18.0))
        return bad(fmt::format("the least dihedral angle is {} degrees; TetGen ends surely for 0 to 18", o.min_dihedral_degrees));
    if (!(o.max_volume >= 0.0) || !std::isfinite(o.max_volume))
        return bad(fmt::format("the largest tet volume is {} m^3; it must be 0 (no bound) or more", o.max_volume));
    if (!(o.time_limit > 0.0 && o.time_limit <= 86400.0))
        return bad(fmt::format("the time limit is {} s; it must be above 0 and at most a day", o.time_limit));
    return {};
}

std::string write_off(const TriMesh& surface, const UnitFrame& frame) {
    std::string text = fmt::format("OFF\n{} {} 0\n", surface.vertices.size(), surface.triangles.size());
    for (const Vec3& v : surface.vertices) {
        const Vec3 p = frame.to_unit(v);
        fmt::format_to(std::back_inserter(text), "{:.17g} {:.17g} {:.17g}\n", p[0], p[1], p[2]);
    }
    for (const Triangle& t : surface.triangles) fmt::format_to(std::back_inserter(text), "3 {} {} {}\n", t[0], t[1], t[2]);
    return text;
}

/// -M: triangles are facets of their own even where coplanar, so that the boundary stays the input's.
std::string write_switches(const TetgenOptions& o, const UnitFrame& frame) {
    std::string text = fmt::format("-pMq{:.6f}/{:.6f}", o.max_radius_edge_ratio, o.min_dihedral_degrees);
    if (o.keep_surface) text += "Y";
    if (o.max_volume > 0.0) text += fmt::format("a{:.25f}", o.max_volume / (frame.size * frame.size * frame.size));
    return text;
}

std::string last_words(const std::string& output) {
    std::string words;
    for (const char c : output) words += c == '\n' || c == '\r' || c == '\t' ? ' ' : c;
    while (!words.empty() && words.back() == ' ') words.pop_back();
    constexpr std::size_t kKept = 300;
    return words.size() > kKept ? "..." + words.substr(words.size() - kKept) : words;
}

Result<void> check_outcome(const ProcessOutcome& outcome, double time_limit) {
    const auto failed = [&](const std::string& how) {
        const std::string memory = outcome.interrupted || outcome.timed_out ? std::string() : tell_memory_limit();
        return Error{.code = ErrorCode::ToolFailed,
                     .message =
                         "TetGen " + how + "; its last words: " + last_words(outcome.output) + (memory.empty() ? "" : "; " + memory)};
    };
    if (outcome.interrupted) return failed("was interrupted");
    if (outcome.timed_out) return failed(fmt::format("was stopped after {:.3g} s", time_limit));
    if (outcome.signal != 0) return failed(fmt::format("was ended by signal {}", outcome.signal));
    if (outcome.exit_code != 0) return failed(fmt::format("ended with exit code {}", outcome.exit_code));
    return {};
}

/// TetGen's result, in metres, with the surface's own vertices bit for bit.
Result<TetMesh> read_result(const std::filesystem::path& file, const TriMesh& surface, const UnitFrame& frame) {
    const auto unusable = [](std::string why) {
        return Error{.code = ErrorCode::ToolFailed, .message = "TetGen returned no usable mesh: " + std::move(why)};
    };
    Result<TetMesh> mesh = read_tets(file);
    if (!mesh) return unusable(mesh.error().message);
    if (mesh->vertices.size() < surface.vertices.size()) return unusable("surface vertices are missing");
    for (std::size_t v = 0; v < mesh->vertices.size(); ++v)
        mesh->vertices[v] = v < surface.vertices.size() ? surface.vertices[v] : frame.from_unit(mesh->vertices[v]);
    const TetMeshReport report = inspect_tets(*mesh);
    if (!report.valid() || report.unreferenced_nodes > 0)
        return unusable(fmt::format("{} inverted and {} flat tets, {} nodes without a tet{}", report.inverted_tets, report.flat_tets,
                                    report.unreferenced_nodes,
                                    report.bad_tets.empty() ? "" : fmt::format(", first tet {}", report.bad_tets[0])));
    return mesh;
}

} // namespace

Result<void> check_meshable_surface(const TriMesh& surface, std::size_t max_compared) {
    if (const auto closed = check_closed_surface(surface); !closed) return closed;
    const SelfIntersections crossings = find_self_intersections(surface, kNamedPairs, Crossing::Touching, max_compared);
    if (crossings.count == 0 && crossings.complete) return {};
    if (crossings.count == 0)
        return Error{.code = ErrorCode::BadMesh,
                     .message = fmt::format("more than {} pairs of triangles are too near to each other to tell whether the surface touches or "
                                            "crosses itself; expected no long thin triangles upon each other",
                                            max_compared)};
    std::string pairs;
    for (const auto& [a, b] : crossings.pairs) pairs += fmt::format("{}{}-{}", pairs.empty() ? "" : ", ", a, b);
    return Error{.code = ErrorCode::BadMesh,
                 .message = fmt::format("the surface touches or crosses itself at {} pair{} of triangles, first {}", crossings.count,
                                        crossings.count == 1 ? "" : "s", pairs)};
}

Result<TetMesh> run_tetgen(const TriMesh& input, const TetgenOptions& options, bool* timed_out) {
    if (timed_out) *timed_out = false;
    if (const auto fine = check_options(options); !fine) return fine.error();
    if (const auto fine = check_meshable_surface(input); !fine) return fine.error();
    TriMesh surface = input;
    drop_unreferenced_vertices(surface);
    const auto program = find_program(options.program, "tetgen");
    if (!program) return program.error();
    const auto folder = TemporaryFolder::make();
    if (!folder) return folder.error();
    const UnitFrame frame(surface);
    if (const auto written = write_file_atomically(folder->path() / "surface.off", write_off(surface, frame)); !written)
        return written.error();
    const auto outcome = run_process(*program, {write_switches(options, frame), "surface.off"}, folder->path(), options.time_limit);
    if (!outcome) return outcome.error();
    if (timed_out) *timed_out = outcome->timed_out;
    if (const auto fine = check_outcome(*outcome, options.time_limit); !fine) return fine.error();
    return read_result(folder->path() / "surface.1.ele", surface, frame);
}

} // namespace trocar::engine
