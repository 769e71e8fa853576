// Image-space culling on the meshes of the image-space paper: a bunny whose ear goes through its back, and two merged cows, 3K to 270K
// triangles.
#include "base/topology.hpp"
#include "collision/culling/cull_twin.hpp"
#include "collision/culling/cullide.hpp"
#include "collision/culling/image_space.hpp"
#include "bench/dented.hpp"
#include "bench/tables.hpp"
#include "engine/render/gl_cull_backend.hpp"
#include "engine/render/hand_over.hpp"
#include "engine/io/read_surface.hpp"
#include "engine/time/clock.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace trocar::engine {

namespace {

struct Subject {
    std::string name;
    const char* file;
    bool merged;  // with a copy of itself, shifted; otherwise its top is pushed through what is below
    int halvings; // each makes four triangles of one
};

constexpr const char* kPaperBunny = "5K to 270K triangles: 20 to 600 ms (500 x 500, GeForce FX 5900)";
constexpr const char* kPaperCows = "3K to 270K triangles: 35 to 1000 ms (500 x 500, GeForce FX 5900)";

/// Four triangles of each: new vertices in the middle of edges, once per edge.
void subdivide(TriMesh& mesh) {
    const auto edges = unique_edges(mesh.triangles);
    const auto middle = [&](Index a, Index b) {
        const std::array<Index, 2> edge = {std::min(a, b), std::max(a, b)};
        return static_cast<Index>(mesh.vertices.size() +
                                  static_cast<std::size_t>(std::lower_bound(edges.begin(), edges.end(), edge) - edges.begin()));
    };
    std::vector<Triangle> finer;
    for (const auto& [a, b, c] : mesh.triangles) {
        const Index ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
        for (const Triangle& t : {Triangle{a, ab, ca}, Triangle{ab, b, bc}, Triangle{ca, bc, c}, Triangle{ab, bc, ca}}) finer.push_back(t);
    }
    const std::size_t before = mesh.vertices.size();
    mesh.vertices.reserve(before + edges.size());
    for (const auto& [a, b] : edges) mesh.vertices.push_back(0.5 * (mesh.vertices[a] + mesh.vertices[b]));
    mesh.triangles = std::move(finer);
}

void merge_with_itself(TriMesh& mesh) {
    const auto count = static_cast<Index>(mesh.vertices.size());
    const Vec3 shift = 0.15 * mesh.bounds().extent();
    const std::size_t triangles = mesh.triangles.size();
    for (Index v = 0; v < count; ++v) mesh.vertices.push_back(mesh.vertices[v] + shift);
    for (std::size_t t = 0; t < triangles; ++t) {
        const Triangle c = mesh.triangles[t];
        mesh.triangles.push_back({c[0] + count, c[1] + count, c[2] + count});
    }
}

double share(std::size_t part, std::size_t whole) { return whole == 0 ? 0.0 : static_cast<double>(part) / static_cast<double>(whole); }

/// Share of all triangles that is pruned after each level, its largest patch before it; the last one is of single triangles.
std::string pruned_by_level(std::span<const collision::ImageSpacePass> passes, std::size_t triangles) {
    std::string text;
    for (std::size_t k = 0; k < passes.size(); ++k) {
        const bool level_ends = k + 1 == passes.size() || passes[k + 1].largest_patch != passes[k].largest_patch;
        if (!level_ends) continue;
        text += fmt::format("{}{}: {:.3f}", text.empty() ? "" : ", ", std::max<std::size_t>(passes[k].largest_patch, 1),
                            1.0 - share(passes[k].triangles_left, triangles));
    }
    return text;
}

/// The conservative form, which ends by a measured rule.
/// patches   whole ones first
BenchRow run_safe(const Subject& subject, const TriMesh& mesh, collision::CullBackend& backend, int resolution, bool patches) {
    StopWatch watch;
    collision::ImageSpaceCuller culler(mesh.triangles, mesh.vertices.size());
    if (patches) culler.prepare_patches();
    const double prepare_ms = watch.lap_ms();
    std::string pruned_by_pass, ms_by_pass;
    HandOver hand_over(mesh.triangles, mesh.vertices);
    StopWatch pass_watch;
    const auto time_pass = [&](const auto& pass) {
        hand_over.see(pass);
        ms_by_pass += fmt::format("{}{:.1f}", ms_by_pass.empty() ? "" : " ", pass_watch.lap_ms());
    };
    const double sample_ms = watch.lap_ms();
    (void)pass_watch.lap_ms();
    const auto left = culler.find_colliding_set(mesh.vertices,
                                                {.resolution = resolution,
                                                 .patches = patches,
                                                 .go_on = [&](const auto& pass) { return hand_over.go_on(pass); },
                                                 .watch = time_pass},
                                                backend);
    const double cull_ms = watch.lap_ms();
    if (!left.ok()) return {{"mesh", subject.name}, {"culler", backend.name()}, {"failed", left.error().message}};
    const auto crossings = collision::find_crossings(mesh.triangles, mesh.vertices, *left);
    const double tests_ms = watch.lap_ms();
    const auto passes = static_cast<double>(culler.passes().size());
    for (const collision::ImageSpacePass& pass : culler.passes())
        pruned_by_pass +=
            fmt::format("{}{:.3f}", pruned_by_pass.empty() ? "" : " ", 1.0 - share(pass.triangles_left, mesh.triangles.size()));
    return {{"mesh", subject.name},
            {"triangles", mesh.triangles.size()},
            {"culler", backend.name() + (patches ? ", patches first" : ", triangle by triangle")},
            {"sets", culler.sets().count()},
            {"prepare_ms", prepare_ms},
            {"sample_ms", sample_ms},
            {"test_us_per_triangle", hand_over.test_us_per_triangle()},
            {"passes", culler.passes().size()},
            {"pass_ms", passes > 0 ? cull_ms / passes : 0.0},
            {"ms_by_pass", ms_by_pass},
            {"pruned_by_pass", pruned_by_pass},
            {"pruned_by_level", pruned_by_level(culler.passes(), mesh.triangles.size())},
            {"pruned", 1.0 - share(left->size(), mesh.triangles.size())},
            {"cull_ms", cull_ms},
            {"tests_ms", tests_ms},
            {"total_ms", cull_ms + tests_ms},
            {"crossings", crossings.size()},
            {"paper", subject.merged ? kPaperCows : kPaperBunny}};
}

/// As in the image-space paper: patches of a hierarchy at the centres of pixels. What it loses stands beside what it found.
BenchRow run_as_paper(const Subject& subject, const TriMesh& mesh, bool connected) {
    StopWatch watch;
    collision::Cullide cullide(mesh.triangles, connected ? collision::make_patch_hierarchy(mesh.triangles, mesh.vertices.size())
                                                         : collision::make_random_hierarchy(mesh.triangles.size(), 1));
    const double prepare_ms = watch.lap_ms();
    const auto left = cullide.find_colliding_set(mesh.vertices, {});
    const double cull_ms = watch.lap_ms();
    const auto crossings = collision::find_crossings(mesh.triangles, mesh.vertices, left);
    const double tests_ms = watch.lap_ms();
    std::size_t queries = 0, drawn = 0, last_tenth = 0;
    for (const collision::CullidePass& pass : cullide.passes()) {
        queries += pass.queries;
        drawn += pass.triangles;
        last_tenth += 10 * pass.triangles < mesh.triangles.size();
    }
    return {{"mesh", subject.name},
            {"triangles", mesh.triangles.size()},
            {"culler", connected ? "as the paper, connected patches" : "as the paper, random patches"},
            {"prepare_ms", prepare_ms},
            {"passes", cullide.passes().size()},
            {"passes_on_last_tenth", last_tenth},
            {"pass_ms", cullide.passes().empty() ? 0.0 : cull_ms / static_cast<double>(cullide.passes().size())},
            {"queries", queries},
            {"triangles_drawn", drawn},
            {"pruned", 1.0 - share(left.size(), mesh.triangles.size())},
            {"cull_ms", cull_ms},
            {"tests_ms", tests_ms},
            {"total_ms", cull_ms + tests_ms},
            {"crossings", crossings.size()},
            {"paper", subject.merged ? kPaperCows : kPaperBunny}};
}

} // namespace

Result<BenchTable> bench_image_space(const BenchOptions& options) {
    BenchTable table;
    if (!options.data) {
        table.notes.push_back("TROCAR_TEST_DATA does not name a folder with the bunny and the cow: nothing was measured");
        return table;
    }
    constexpr int kPaperResolution = 500;
    std::vector<Subject> subjects = {{"bunny", "stanford/bunny_7k_closed.off.gz", false, 0},
                                     {"two cows", "cow/cow_viewpoint_5.8k.obj.gz", true, 0}};
    if (!options.quick) {
        subjects.push_back({"bunny, finer", "stanford/bunny_60k_manifold.obj.gz", false, 0});
        subjects.push_back({"bunny, finest", "stanford/bunny_60k_manifold.obj.gz", false, 1});
        subjects.push_back({"two cows, finer", "cow/cow_viewpoint_5.8k.obj.gz", true, 1});
        subjects.push_back({"two cows, finest", "cow/cow_viewpoint_5.8k.obj.gz", true, 2});
    }
    auto gl = GlCullBackend::make();
    table.notes.push_back(gl.ok() ? "OpenGL: " + (*gl)->name() : "no OpenGL: " + gl.error().message);
    collision::CpuCullBackend twin;
    for (const Subject& subject : subjects) {
        options.progress(subject.name);
        auto mesh = read_surface(*options.data / subject.file, {.weld = true});
        if (!mesh.ok()) return mesh.error();
        for (int k = 0; k < subject.halvings; ++k) subdivide(*mesh);
        if (subject.merged)
            merge_with_itself(*mesh);
        else
            push_top_down(*mesh);
        for (const bool patches : {true, false}) {
            table.rows.push_back(run_safe(subject, *mesh, twin, kPaperResolution, patches));
            const bool small = subject.halvings == 0 && mesh->triangles.size() < 20'000; // where OpenGL is drawn by software
            if (gl.ok() && (small || !(*gl)->is_software()))
                table.rows.push_back(run_safe(subject, *mesh, **gl, kPaperResolution, patches));
        }
        table.rows.push_back(run_as_paper(subject, *mesh, true));
        if (subject.halvings == 0) table.rows.push_back(run_as_paper(subject, *mesh, false));
    }
    table.notes.push_back("the sets' rows are conservative and exact to the last crossing; the paper's form prunes by pixel centres and "
                          "can lose crossings: compare "
                          "the counts; all of it is drawn by the CPU where the culler is not a graphics card");
    return table;
}

} // namespace trocar::engine
