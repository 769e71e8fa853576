// Sphere trees of many meshes by each builder, beside the toolkit that everyone uses; the descent's rate of tests.
#include "base/simplify.hpp"
#include "bench/deforming_bodies.hpp"
#include "bench/solid_bodies.hpp"
#include "bench/tables.hpp"
#include "engine/io/read_surface.hpp"
#include "engine/time/clock.hpp"
#include "spheretree/update/covering_tree.hpp"
#include "spheretree/build/tree_quality.hpp"

#include <fmt/format.h>

#include <thread>

#include <algorithm>

namespace trocar::engine {

namespace {

using spheretree::Builder;

struct TreeSubject {
    const char* name;
    const char* file;
    std::size_t triangles; // simplified to so many; 0: as it is
    bool in_quick;
};
constexpr TreeSubject kTreeSubjects[] = {
    {"bunny 3.7K", "stanford/bunny_7k_closed.off.gz", 3674, false}, {"bunny 7K", "stanford/bunny_7k_closed.off.gz", 0, true},
    {"armadillo 1K", "stanford/armadillo_1k_sofa.obj", 0, true},    {"spot 5.9K", "cow/spot_5.9k.obj.gz", 0, false},
    {"cow 5.8K", "cow/cow_viewpoint_5.8k.obj.gz", 0, false},        {"dragon 11K", "stanford/dragon_vrip_res4.ply.gz", 0, false},
    {"armadillo 29K", "stanford/armadillo_29k.obj.gz", 0, false},   {"bunny 60K", "stanford/bunny_60k_manifold.obj.gz", 0, false},
    {"armadillo 86K", "stanford/armadillo_86k.obj.gz", 0, false}};
constexpr const char* kToolkit = "3.7K bunny: 493 leaves, 152/58/38 per mille, volume 1.059, 1.4 % uncovered, 98 % reachable, 123 s";
constexpr std::size_t kBaselinesUpTo = 12000; // triangles: larger meshes are skipped for the slow baselines

BenchRow judge(const std::string& name, const SolidBody& body, bool solid) {
    const spheretree::TreeQuality quality = spheretree::measure_quality(body.tree, body.mesh, solid);
    const double size = body.mesh.bounds().longest_edge();
    BenchRow row{
        {"mesh", name}, {"triangles", body.mesh.triangles.size()}, {"builder", body.builder}, {"leaves", quality.levels.back().count}};
    for (std::size_t level = 1; level < quality.levels.size() && level <= 3; ++level)
        row[fmt::format("outside_{}_permille", level)] = 1e3 * quality.levels[level].outside_max / size;
    row["outside_mean_permille"] = 1e3 * quality.levels.back().outside_mean / size;
    row["volume_ratio"] = solid ? BenchRow(quality.volume_ratio) : BenchRow(nullptr);
    double uncovered = 0.0;
    for (const auto& level : quality.levels) uncovered = std::max(uncovered, level.uncovered);
    row["uncovered_percent"] = 100.0 * uncovered;
    row["reachable_percent"] = 100.0 * quality.levels.back().reachable;
    row["build_s"] = body.build_s;
    row["build_cpu_s"] = body.build_cpu_s;
    return row;
}

void add_builders(const std::string& name, const TriMesh& mesh, const BenchOptions& options, BenchTable& table) {
    for (const Builder builder : {Builder::Medial, Builder::Octree, Builder::Hubbard, Builder::Shell}) {
        const bool baseline = builder == Builder::Octree || builder == Builder::Hubbard;
        if (baseline && (options.quick || mesh.triangles.size() > kBaselinesUpTo)) continue;
        const Result<void> fits = spheretree::check_surface_for(mesh, builder);
        if (!fits) {
            table.notes.push_back(fmt::format("{}, {}: {}", name, spheretree::builder_name(builder), fits.error().message));
            continue;
        }
        if (builder == Builder::Shell && spheretree::check_surface_for(mesh, Builder::Medial)) continue; // for surfaces without an inside
        options.progress(fmt::format("{}, {}", name, spheretree::builder_name(builder)));
        const Result<SolidBody> body = make_solid_body(name, mesh, builder);
        if (!body) {
            table.notes.push_back(fmt::format("{}, {}: {}", name, spheretree::builder_name(builder), body.error().message));
            continue;
        }
        BenchRow row = judge(name, *body, spheretree::check_surface_for(mesh, Builder::Medial).ok());
        row["threads"] = std::max(1u, std::thread::hardware_concurrency()); // oneTBB's, of build_s
        row["toolkit"] = builder == Builder::Medial && name.starts_with("bunny") ? BenchRow(kToolkit) : BenchRow(nullptr);
        table.rows.push_back(row);
    }
}

/// Sphere pairs a second, the traversal alone and with the spheres of both bodies updated before it.
void add_rates(const SolidBody& body, BenchTable& table) {
    const spheretree::CoveringTree covering = spheretree::build_covering_tree(body.mesh);
    const PlacedBody beside = place(body, {0.6, Vec3(0.45 * body.mesh.bounds().extent().x(), 0.0, 0.0)});
    const PlacedBody here = place(body, {});
    std::vector<spheretree::Sphere> a, b;
    spheretree::Descent descent;
    constexpr int kRounds = 40;
    std::int64_t update_ns = 0, test_ns = 0;
    std::uint64_t tests = 0;
    for (int round = 0; round < kRounds; ++round) {
        const std::int64_t start = thread_cpu_ns();
        spheretree::update_covering_spheres(covering, here.mesh.vertices, here.mesh.vertices, a);
        spheretree::update_covering_spheres(covering, beside.mesh.vertices, beside.mesh.vertices, b);
        const std::int64_t updated = thread_cpu_ns();
        descent.begin(0.0);
        descent.add_solid_pair({Thing::body(0), &covering.tree, a}, {Thing::body(1), &covering.tree, b});
        WorkBudget budget;
        descent.run(budget);
        update_ns += updated - start;
        test_ns += thread_cpu_ns() - updated;
        tests += descent.stats().pairs_tested;
    }
    const auto millions = [&](std::int64_t ns) { return 1e3 * static_cast<double>(tests) / static_cast<double>(ns); };
    table.rows.push_back({{"mesh", "two of " + body.name},
                          {"builder", "covering"},
                          {"pair_tests", tests / kRounds},
                          {"million_tests_per_s", millions(test_ns)},
                          {"with_updates", millions(test_ns + update_ns)},
                          {"update_ns_per_sphere", static_cast<double>(update_ns) / (2.0 * kRounds * static_cast<double>(a.size()))}});
}

} // namespace

Result<BenchTable> bench_spheretree(const BenchOptions& options) {
    BenchTable table;
    if (options.data)
        for (const TreeSubject& subject : kTreeSubjects) {
            if (options.quick && !subject.in_quick) continue;
            options.progress(subject.name);
            Result<TriMesh> mesh = read_surface(*options.data / subject.file, {.weld = true});
            if (mesh && subject.triangles > 0) mesh = simplify(*mesh, subject.triangles);
            if (!mesh) return mesh.error();
            add_builders(subject.name, *mesh, options, table);
        }
    const Result<std::vector<SolidBody>> bodies = make_dragon_and_bunny(options);
    if (!bodies) return bodies.error();
    if (!options.data) {
        for (const SolidBody& body : *bodies) add_builders(body.name, body.mesh, options, table);
        table.notes.push_back("TROCAR_TEST_DATA names no folder: generated bodies stand in for the scans");
    }
    add_rates(bodies->back(), table);
    options.progress(bodies->back().name + ", updates");
    if (const Result<void> updated = add_updates(bodies->back(), table); !updated) return updated.error();
    table.notes.push_back(
        "conservative, the paper's: the wrapped tree on a lattice of about 1500 nodes, updated sphere by sphere; escape: the farthest "
        "vertex outside all leaves, per mille of the longest edge; rates of these rows include the updates");
    table.notes.push_back(
        "branching 8, depth 3; uncovered: the worst level; outside_N: the farthest that any sphere of level N reaches outside");
    table.notes.push_back("toolkit: Bradshaw's, adaptive medial axis, quoted: measured elsewhere, on a machine and threads that are not known; it is not run here");
    return table;
}

} // namespace trocar::engine
