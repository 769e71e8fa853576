#include "engine/prepare/prepare_mesh.hpp"

#include "base/self_intersection.hpp"
#include "base/surface_area.hpp"
#include "collision/culling/chromatic_sets.hpp"
#include "engine/io/read_surface.hpp"
#include "engine/prepare/cache.hpp"
#include "engine/prepare/coarse.hpp"
#include "engine/prepare/foreign_spheres.hpp"
#include "engine/prepare/payload.hpp"
#include "engine/prepare/surface_rule.hpp"
#include "engine/time/clock.hpp"
#include "fem/mesh/lattice.hpp"
#include "fem/embedding/links.hpp"
#include "fem/tissue/stable_step.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

#include <sys/resource.h>

namespace trocar::engine {

namespace {

constexpr std::string_view kKind = "spheres";
/// m; nothing that a catheter meets is larger or smaller: more is a mistaken unit, most likely.
constexpr double kSmallestMesh = 1e-3, kLargestMesh = 3.0;
constexpr double kSmallestSide = 1e-30;                          // m; squares of smaller volumes would underflow
constexpr double kRounding = 1e-12;                              // of a size: areas and volumes below it are rounding error
constexpr std::size_t kMostPerVertex = 32, kFewTriangles = 1000; // triangles

/// Smallest angle between two faces of any tet.
double min_dihedral_deg(const TetMesh& mesh) {
    double largest_cosine = -1.0;
    for (const Tet& t : mesh.tets) {
        std::array<Vec3, 4> normal; // outward, of the face across from each node
        for (std::size_t k = 0; k < 4; ++k) {
            const Vec3 &a = mesh.vertices[t[(k + 1) % 4]], &b = mesh.vertices[t[(k + 2) % 4]], &c = mesh.vertices[t[(k + 3) % 4]];
            normal[k] = (b - a).cross(c - a).normalized();
            if (normal[k].dot(mesh.vertices[t[k]] - a) > 0.0) normal[k] = -normal[k];
        }
        for (std::size_t i = 0; i < 4; ++i)
            for (std::size_t k = i + 1; k < 4; ++k) largest_cosine = std::max(largest_cosine, -normal[i].dot(normal[k]));
    }
    return std::acos(std::clamp(largest_cosine, -1.0, 1.0)) * 180.0 / std::numbers::pi;
}

/// Triangles that all share a few vertices overlap: crossings among them would be searched for pair by pair.
std::string find_crowd(const TriMesh& surface) {
    const std::size_t triangles = surface.triangles.size(), most = std::max(kFewTriangles, kMostPerVertex * surface.vertices.size());
    if (triangles <= most) return "";
    return fmt::format("{} triangles share {} vertices; a surface has about 2 a vertex; expected at most {} here; "
                       "repairs \"drop_degenerate,drop_duplicates\" remove those that lie upon others",
                       triangles, surface.vertices.size(), most);
}

/// What a surface lacks for a sphere tree: a size or an area. Empty: nothing.
std::string find_flatness(const TriMesh& surface) {
    const double size = surface.bounds().longest_edge();
    if (size == 0.0) return "all vertices lie at one point: the surface has no area";
    if (!(size >= kSmallestSide))
        return fmt::format("the longest side is {:g} m; expected at least {:g} m: is --unit right?", size, kSmallestSide);
    const double area = surface_area(surface); // m^2
    if (!(area > kRounding * size * size))
        return fmt::format("the surface has no area: {:g} m^2 with a longest side of {:g} m; expected more than {:g} m^2", area, size,
                           kRounding * size * size);
    return "";
}

/// The same of a volume, where the builder fills one and the surface bounds one.
std::string find_emptiness(const MeshPreparation& made, spheretree::Builder builder) {
    const SurfaceReport& r = made.dense;
    if (!spheretree::needs_closed(builder) || !r.closed() || !r.oriented() || r.nonmanifold_edges > 0) return "";
    const double area = surface_area(made.surface), size = made.surface.bounds().longest_edge();
    const double least = kRounding * area * size; // m^3
    if (!(std::abs(r.signed_volume) > least))
        return fmt::format("the surface holds no volume: {:g} m^3 within {:g} m^2; expected more than {:g} m^3; "
                           "builder \"shell\" takes flat ones",
                           r.signed_volume, area, least);
    return "";
}

Result<void> load(const std::filesystem::path& file, const PrepareOptions& options, MeshPreparation& made) {
    ReadOptions read;
    read.weld = true;
    std::string origin;
    Result<TriMesh> mesh = read_surface(file, read, &origin);
    if (!mesh.ok()) return mesh.error();
    if (!origin.empty()) made.notes.push_back(std::move(origin));
    const auto bad = [&](std::string message) { return Error{ErrorCode::BadMesh, std::move(message), file.string()}; };
    for (std::size_t i = 0; i < mesh->vertices.size(); ++i) { // before the repairs, which multiply coordinates too
        Vec3& v = mesh->vertices[i];
        v *= options.unit;
        if (const double largest = v.cwiseAbs().maxCoeff(); largest > spheretree::kLargestCoordinate)
            return bad(fmt::format("vertex {} lies {:.6g} m from the origin (unit {:g} m); expected at most {:g} m", i, largest,
                                   options.unit, spheretree::kLargestCoordinate));
    }
    if (const Result<void> fans = check_fans(*mesh); !fans.ok()) return bad(fans.error().message);
    const TriMesh raw = *mesh;
    const bool closed = spheretree::needs_closed(options.spheres.builder);
    const std::string builder(spheretree::builder_name(options.spheres.builder));
    const SurfaceNeeds needs{fmt::format("the {} builder", builder), closed, closed};
    const auto refuse = [&](const std::string& what) {
        const std::string help = describe_advice(propose_repairs(raw, options.repairs, needs, options.repairing), RepairWriting::Option, what);
        return bad(what + help + (closed ? "; builder \"shell\" takes any surface" : ""));
    };
    const Result<RepairReport> repaired = apply_repairs(*mesh, options.repairs, options.repairing);
    if (!repaired.ok()) return refuse(repaired.error().message);
    for (const RepairStep& step : repaired->steps) made.notes.push_back("repair " + step.to_string());
    drop_unreferenced_vertices(*mesh);
    if (const Result<void> fans = check_fans(*mesh); !fans.ok()) return bad("after the repairs " + fans.error().message);
    made.surface = std::move(*mesh);
    made.dense = inspect_surface(made.surface);
    if (std::string crowd = find_crowd(made.surface); !crowd.empty()) return bad(std::move(crowd));
    if (std::string lacking = find_flatness(made.surface); !lacking.empty()) return bad(std::move(lacking));
    if (const Result<void> finite = spheretree::check_surface_for(made.surface, spheretree::Builder::Shell); !finite.ok())
        return bad(finite.error().message);
    if (std::string lacking = find_emptiness(made, options.spheres.builder); !lacking.empty()) return bad(std::move(lacking));
    if (const auto defect = closed ? find_defect(made.surface, made.dense, needs) : std::nullopt)
        return defect->repair ? refuse(defect->what) : bad(defect->what);
    for (std::string& note : list_leniencies(made.dense)) made.notes.push_back(std::move(note));
    if (!closed) {
        const SelfIntersections crossings = find_self_intersections(made.surface, 0);
        made.self_intersections = crossings.count;
        made.crossings_known = crossings.complete;
        if (!crossings.complete) made.notes.push_back("the surface " + describe_crossings(crossings));
    }
    const double size = made.surface.bounds().longest_edge();
    if (!(size >= kSmallestMesh && size <= kLargestMesh))
        made.notes.push_back(fmt::format("the longest side is {:.6g} m: is --unit right?", size));
    return {};
}

/// The quality of a mesh as a body of the options' material; none: it is no body, and a note says why.
std::optional<MeshPreparation::Coarse> rate_coarse(const TetMesh& tets, const char* mesher, const PrepareOptions& options,
                                                   MeshPreparation& made) {
    const Result<fem::TissueModel> tissue = fem::make_tissue_model(tets, options.material, {});
    if (!tissue.ok()) {
        made.notes.push_back(fmt::format("no coarse model by {}: {}", mesher, tissue.error().message));
        return std::nullopt;
    }
    fem::StableStepWorkspace workspace;
    const double step = fem::find_stable_step(*tissue, tissue->rest_position, nullptr, workspace).step;
    return MeshPreparation::Coarse{
        tets.vertices.size(), tets.tets.size(), mesher, min_dihedral_deg(tets), step, tissue->volume / signed_volume(made.surface)};
}

void make_coarse_model(const PrepareOptions& options, MeshPreparation& made) {
    if (!made.dense.closed() || !made.dense.manifold() || !made.dense.oriented() || made.self_intersections > 0 || !made.crossings_known) {
        made.notes.push_back("no coarse model: the surface is not a closed manifold that encloses a volume");
        return;
    }
    CoarseOptions coarse_options;
    coarse_options.surface_triangles = options.coarse_triangles;
    coarse_options.use_cache = options.use_cache;
    const Result<CoarseMesh> coarse = make_coarse_mesh(made.surface, coarse_options);
    if (!coarse.ok())
        made.notes.push_back("no coarse model: " + coarse.error().message);
    else {
        made.coarse = rate_coarse(coarse->tets, "tetgen", options, made);
        const Result<fem::RigidLinks> links = fem::make_surface_links(coarse->tets, made.surface);
        if (links.ok())
            made.links = {links->vertex_count(), links->degenerate, links->max_length};
        else
            made.notes.push_back("no links: " + links.error().message);
    }
    const std::size_t nodes = made.coarse ? made.coarse->nodes : options.coarse_triangles / 2;
    const Result<fem::LatticeMesh> lattice = fem::make_lattice_of_nodes(made.surface, nodes);
    if (lattice.ok()) {
        made.lattice = rate_coarse(lattice->tets, "lattice", options, made);
        if (lattice->island_tets > 0)
            made.notes.push_back(fmt::format("a lattice leaves {} of its {} tetrahedra out: parts apart from the largest one",
                                             lattice->island_tets, lattice->island_tets + lattice->tets.tets.size()));
    } else
        made.notes.push_back("no coarse model by lattice: " + lattice.error().message);
}

std::string find_key(const MeshPreparation& made, const PrepareOptions& options) {
    ContentHash hash;
    hash.feed(maker_version());
    hash.feed(made.surface);
    hash.feed(spheretree::builder_name(options.spheres.builder));
    hash.feed(static_cast<std::uint64_t>(options.spheres.branching));
    hash.feed(static_cast<std::uint64_t>(options.spheres.depth));
    return hash.hex();
}

std::string pack(const MeshPreparation& made) {
    Payload payload;
    payload.put_tree(made.spheres);
    payload.put(made.quality.levels);
    payload.put(std::vector<double>{made.quality.volume_ratio, made.sphere_seconds, made.sphere_peak_mb, made.spheres_coarser ? 1.0 : 0.0});
    return payload.bytes();
}

bool unpack(std::string bytes, MeshPreparation& made) {
    Payload payload(std::move(bytes));
    spheretree::SphereTree tree;
    std::vector<double> numbers;
    if (!payload.get_tree(tree) || !payload.get(made.quality.levels) || !payload.get(numbers) || numbers.size() != 4) return false;
    made.spheres = std::move(tree);
    made.quality.volume_ratio = numbers[0];
    made.sphere_seconds = numbers[1];
    made.sphere_peak_mb = numbers[2];
    made.spheres_coarser = numbers[3] != 0.0;
    return true;
}

double peak_mb() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return static_cast<double>(usage.ru_maxrss) / 1024.0;
}

/// Has it an inside that spheres are measured against?
bool is_solid(const MeshPreparation& made) {
    return made.dense.closed() && made.dense.oriented() && made.dense.signed_volume > 0.0;
}

Result<void> take_spheres(const PrepareOptions& options, MeshPreparation& made) {
    StopWatch watch;
    Result<spheretree::AdoptedTree> adopted = load_spheres(options.spheres_file, {.scale = options.unit}, made.surface);
    if (!adopted.ok()) return adopted.error();
    made.sphere_seconds = 1e-3 * watch.lap_ms();
    made.sphere_peak_mb = peak_mb();
    made.notes.push_back(describe_coverage(options.spheres_file, *adopted));
    made.coverage = adopted->coverage;
    made.spheres = std::move(adopted->tree);
    made.quality = spheretree::measure_quality(made.spheres, made.surface, is_solid(made));
    return {};
}

/// progress  of the tree, 0..1
Result<void> make_spheres(const PrepareOptions& options, MeshPreparation& made, const std::function<void(double share)>& progress) {
    if (!options.spheres_file.empty()) return take_spheres(options, made);
    const std::string key = find_key(made, options);
    if (options.use_cache)
        if (auto payload = read_cache(kKind, key); payload && unpack(std::move(*payload), made)) {
            made.spheres_from_cache = true;
            return {};
        }
    StopWatch watch;
    Result<spheretree::WrappedTree> built = spheretree::build_wrapped_tree(made.surface, options.spheres, progress);
    if (!built.ok()) return built.error();
    made.sphere_seconds = 1e-3 * watch.lap_ms();
    made.sphere_peak_mb = peak_mb();
    made.spheres_coarser = built->coarser;
    made.spheres = std::move(built->tree);
    const bool solid = is_solid(made) && options.spheres.builder != spheretree::Builder::Shell;
    made.quality = spheretree::measure_quality(made.spheres, made.surface, solid);
    if (options.use_cache) write_cache(kKind, key, pack(made));
    return {};
}

nlohmann::ordered_json level_json(const spheretree::LevelQuality& level, double per_mille) {
    return {{"count", level.count},
            {"outside_max", per_mille * level.outside_max},
            {"outside_mean", per_mille * level.outside_mean},
            {"uncovered", level.uncovered},
            {"reachable", level.reachable}};
}

} // namespace

/// Shares of the whole, by what they take of a mesh of some thousand triangles.
constexpr double kTreeBegins = 0.05, kTreeEnds = 0.75, kColoursBegin = 0.95;

Result<MeshPreparation> prepare_mesh(const std::filesystem::path& file, const PrepareOptions& options,
                                     const std::function<void(const std::string&)>& progress) {
    MeshPreparation made;
    const auto tell = [&](const char* what, double share) { progress(fmt::format("{}, {:.0f} %", what, 100.0 * share)); };
    tell("surface", 0.0);
    if (const Result<void> loaded = load(file, options, made); !loaded.ok()) return loaded.error();
    tell("sphere tree", kTreeBegins);
    const auto of_tree = [&](double share) { tell("sphere tree", kTreeBegins + (kTreeEnds - kTreeBegins) * share); };
    if (const Result<void> built = make_spheres(options, made, of_tree); !built.ok()) {
        Error error = built.error();
        if (error.file.empty()) error.file = file.string();
        return error;
    }
    if (made.spheres_coarser) made.notes.push_back(spheretree::describe_coarser(made.surface));
    tell("coarse model and links", kTreeEnds);
    make_coarse_model(options, made);
    tell("chromatic sets", kColoursBegin);
    StopWatch watch;
    made.colours = collision::make_chromatic_sets(made.surface.triangles, made.surface.vertices.size()).count();
    made.colour_seconds = 1e-3 * watch.lap_ms();
    return made;
}

namespace {

nlohmann::ordered_json coarse_json(const std::optional<MeshPreparation::Coarse>& coarse) {
    if (!coarse) return nullptr;
    return {{"nodes", coarse->nodes},
            {"tets", coarse->tets},
            {"mesher", coarse->mesher},
            {"min_dihedral_deg", coarse->min_dihedral_deg},
            {"stable_step_s", coarse->stable_step_s},
            {"volume_ratio", coarse->volume_ratio}};
}

} // namespace

std::string preparation_json(const MeshPreparation& made, const PrepareOptions& options) {
    using Json = nlohmann::ordered_json;
    const double size = made.surface.bounds().longest_edge();
    const double per_mille = size > 0.0 ? 1e3 / size : 0.0;
    Json json;
    json["dense"] = {{"vertices", made.surface.vertices.size()},
                     {"triangles", made.surface.triangles.size()},
                     {"closed", made.dense.closed()},
                     {"manifold", made.dense.manifold()},
                     {"self_intersections", made.self_intersections},
                     {"components", made.dense.components},
                     {"longest_edge_m", size}};
    json["coarse"] = coarse_json(made.coarse);
    json["coarse_by_lattice"] = coarse_json(made.lattice);
    json["links"] = nullptr;
    if (made.links)
        json["links"] = {{"count", made.links->count}, {"max_length_m", made.links->max_length_m}, {"degenerate", made.links->degenerate}};
    Json levels = Json::array();
    for (const spheretree::LevelQuality& level : made.quality.levels) levels.push_back(level_json(level, per_mille));
    const bool from_file = !options.spheres_file.empty();
    json["spheres"] = {{"builder", from_file ? std::string_view("file") : spheretree::builder_name(options.spheres.builder)},
                       {"branching", options.spheres.branching},
                       {"depth", options.spheres.depth},
                       {"levels", levels},
                       {"volume_ratio", made.quality.volume_ratio},
                       {"seconds", made.sphere_seconds},
                       {"peak_mb", made.sphere_peak_mb},
                       {"from_cache", made.spheres_from_cache}};
    if (from_file) { // the tree's own, not the options of a builder that did not run
        const spheretree::Coverage& c = *made.coverage;
        Json& spheres = json["spheres"];
        spheres["branching"] = made.spheres.child_count.empty() ? 0 : *std::max_element(made.spheres.child_count.begin(), made.spheres.child_count.end());
        spheres["depth"] = made.spheres.leaf_depth();
        spheres["file"] = options.spheres_file.string();
        spheres["as_it_came"] = {{"uncovered", c.uncovered},         {"uncovered_triangles", c.triangles}, {"farthest_m", c.farthest},
                                 {"unreachable", c.unreachable},     {"grown_leaves", c.grown_leaves},     {"leaf_growth_m", c.leaf_growth},
                                 {"grown_inner", c.grown_inner},     {"inner_growth_m", c.inner_growth},   {"idle_leaves", c.idle_leaves}};
    }
    json["chromatic"] = {{"colours", made.colours}, {"seconds", made.colour_seconds}};
    json["unit_m"] = options.unit;
    json["notes"] = made.notes;
    return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n"; // names of files may hold any bytes
}

} // namespace trocar::engine
