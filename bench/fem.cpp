// What the tissue costs: forces per tet and evaluation by law, instruction set and threads; processor seconds per simulated
// second under each integrator; dense links; Bullet's forces on the same meshes beside them.
#include "bench/bench.hpp"
#include "bench/tables.hpp"
#include "engine/prepare/prepare_scene.hpp"
#include "engine/prepare/process.hpp"
#include "engine/time/clock.hpp"
#include "fem/mesh/bar_mesh.hpp"
#include "fem/tissue/integrate.hpp"
#include "fem/embedding/links.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <thread>

namespace trocar::engine {

namespace {

constexpr double kFrame = 0.01;              // s, simulated between two derivations of the step at least
constexpr double kSampleSeconds = 0.4;       // of processor time per row
constexpr double kPeerSeconds = 120.0;       // wall, then it is given up
constexpr double kSwing = 1.0, kHang = 9.81; // m/s^2: a bar that swings by half its length; one that hangs from its end, stretched
constexpr double kBulletGuessNs = 60.0;      // per tet, to choose how many evaluations to ask for

struct Body {
    std::string name;
    TetMesh mesh;
    std::vector<Index> pinned;
    TriMesh dense;
};

struct LawUnderTest {
    std::string_view name;
    fem::MaterialLaw law;
    double viscosity; // Pa s
    fem::TetElements elements = fem::TetElements::Patched; // what Automatic is at this Poisson's ratio
    double relaxing = 0.0; // [-] g of a branch
};
constexpr LawUnderTest kTimedLaws[] = {{"stvk", fem::MaterialLaw::StVK, 1.0},
                                       {"stvk", fem::MaterialLaw::StVK, 0.0},
                                       {"neo_hookean", fem::MaterialLaw::NeoHookean, 1.0},
                                       {"neo_hookean", fem::MaterialLaw::NeoHookean, 0.0},
                                       {"corotational", fem::MaterialLaw::Corotational, 0.0},
                                       {"stvk", fem::MaterialLaw::StVK, 0.0, fem::TetElements::Linear},
                                       {"neo_hookean", fem::MaterialLaw::NeoHookean, 1.0, fem::TetElements::Linear},
                                       {"neo_hookean", fem::MaterialLaw::NeoHookean, 0.0, fem::TetElements::Linear},
                                       {"corotational", fem::MaterialLaw::Corotational, 0.0, fem::TetElements::Linear},
                                       {"mooney_rivlin", fem::MaterialLaw::MooneyRivlin, 0.0},
                                       {"ogden", fem::MaterialLaw::Ogden, 0.0},
                                       {"hgo", fem::MaterialLaw::Hgo, 0.0},
                                       {"neo_hookean, relaxing", fem::MaterialLaw::NeoHookean, 0.0, fem::TetElements::Patched, 1.0}};

/// 20 kPa at small strain, whatever the law; fibres on top.
fem::Material soft_material(const LawUnderTest& law) {
    fem::Material material{.law = law.law, .young_modulus = 20000.0, .poisson_ratio = 0.45, .density = 1000.0, .viscosity = law.viscosity};
    const double mu = material.young_modulus / (2.0 * (1.0 + material.poisson_ratio));
    material.elements = law.elements;
    material.c10 = 0.35 * mu, material.c01 = 0.15 * mu;
    material.alpha1 = 8.0, material.mu1 = 2.0 * mu / 8.0;
    material.k1 = 10000.0, material.k2 = 1.0, material.fibre2 = Vec3::UnitY();
    material.g1 = law.relaxing, material.tau1 = 0.1;
    return material;
}

constexpr std::string_view name_elements(const LawUnderTest& law) {
    return law.elements == fem::TetElements::Linear ? "linear" : "patched";
}

/// Median over calls of the thread's own time, or of wall time where several threads work; s.
template <class Work>
double time_calls(bool wall, bool quick, Work&& work) {
    const auto now = [&] { return wall ? monotonic_ns() : thread_cpu_ns(); };
    work();
    std::vector<double> seconds;
    double total = 0.0;
    while (seconds.size() < 5 || (total < (quick ? 0.1 : 1.0) * kSampleSeconds && seconds.size() < 2000)) {
        const std::int64_t begin = now();
        work();
        seconds.push_back(1e-9 * static_cast<double>(now() - begin));
        total += seconds.back();
    }
    return median(seconds);
}

BenchRow force_row(const Body& body, const fem::TissueModel& model, const LawUnderTest& law, unsigned threads, bool quick) {
    std::vector<fem::NodeRecord> records(model.node_count());
    std::vector<fem::PartialForce> partial(model.plan.slots.size());
    std::vector<Vec3> moved = model.rest_position;
    for (std::size_t i = 0; i < moved.size(); ++i) moved[i] += 1e-4 * Vec3(std::sin(1.7 * i), std::sin(2.3 * i), std::sin(3.1 * i));
    fem::gather_records(model.plan, moved, moved, records);
    const auto kernel = law.viscosity > 0.0 ? fem::TetKernel::ViscousForce : fem::TetKernel::Force;
    const std::size_t repeats = 1 + 20000 / model.tet_count(); // reading the clock costs as much as 60 tets
    const double seconds = time_calls(threads > 1, quick,
                                      [&] {
                                          for (std::size_t k = 0; k < repeats; ++k)
                                              fem::run_tets(model.plan, fem::make_tet_job(model, kernel, threads), records, partial);
                                      }) /
                           static_cast<double>(repeats);
    return {{"name", body.name},
            {"law", law.name},
            {"elements", name_elements(law)},
            {"viscous", law.viscosity > 0.0},
            {"tets", model.tet_count()},
            {"ns_per_tet", 1e9 * seconds / static_cast<double>(model.tet_count())},
            {"peer", false},
            {"isa", fem::chosen_isa()},
            {"precision", "double"},
            {"threads", threads},
            {"clock", threads > 1 ? "wall" : "cpu"},
            {"cpu_s_per_sim_s", nullptr},
            {"integrator", "none"}};
}

/// Processor seconds per simulated second that the 5K bar may take, by integrator; null for other bodies and motions.
BenchRow cpu_target(const Body& body, fem::Integrator integrator, double gravity) {
    if (body.name != "bar_5k" || gravity != kSwing) return nullptr;
    return integrator == fem::Integrator::Rk4 ? 0.10 : 0.03;
}

/// The body is held at its pinned nodes and falls under `gravity` [m/s^2]: sub-steps derived and derived again as in a run.
BenchRow integrator_row(const Body& body, const fem::TissueModel& model, const LawUnderTest& law, fem::Integrator integrator,
                        double gravity, unsigned threads, bool quick) {
    fem::TissueState state = fem::make_rest_state(model);
    fem::RkWorkspace workspace;
    fem::StableStepWorkspace stable;
    workspace.threads = stable.threads = threads;
    fem::IntegrateInputs inputs;
    inputs.gravity = Vec3(0.0, 0.0, -gravity);
    fem::SubstepLimits limits;
    limits.integrator = integrator;
    unsigned substeps = 0, estimates = 0;
    double simulated = 0.0;
    const auto now = [&] { return threads > 1 ? monotonic_ns() : thread_cpu_ns(); };
    (void)fem::advance(model, state, kFrame, inputs, limits, workspace, stable);
    double seconds = 0.0, tightest = 1.0;
    while (seconds < (quick ? 0.1 : 1.0) * kSampleSeconds && simulated < 1.0) {
        const std::int64_t begin = now();
        const fem::AdvanceReport done = fem::advance(model, state, kFrame, inputs, limits, workspace, stable);
        seconds += 1e-9 * static_cast<double>(now() - begin);
        substeps += done.integrate.substeps_done;
        estimates += done.estimates;
        tightest = std::min(tightest, done.tightest.step);
        simulated += kFrame;
    }
    const double evaluations = (integrator == fem::Integrator::Rk4 ? 4.0 : 1.0) * substeps;
    return {{"name", body.name},
            {"law", law.name},
            {"elements", name_elements(law)},
            {"viscous", law.viscosity > 0.0},
            {"tets", model.tet_count()},
            {"ns_per_tet", 1e9 * seconds / (evaluations * static_cast<double>(model.tet_count()))},
            {"peer", false},
            {"isa", fem::chosen_isa()},
            {"precision", "double"},
            {"threads", threads},
            {"clock", threads > 1 ? "wall" : "cpu"},
            {"cpu_s_per_sim_s", seconds / simulated},
            {"integrator", integrator == fem::Integrator::Rk4 ? "rk4" : "leapfrog"},
            {"target_cpu_s", cpu_target(body, integrator, gravity)},
            {"gravity_m_s2", gravity},
            {"stable_step_s", tightest},
            {"substeps_per_s", substeps / simulated},
            {"derived_per_s", estimates / simulated}};
}

BenchRow link_row(const Body& body, const fem::TissueModel& model, unsigned threads, bool quick) {
    const auto links = fem::make_surface_links(body.mesh, body.dense);
    if (!links.ok()) return {{"name", body.name + " links"}, {"error", links.error().to_string()}};
    std::vector<Vec3> moved = model.rest_position, out(body.dense.vertices.size());
    for (std::size_t i = 0; i < moved.size(); ++i) moved[i] += 1e-3 * Vec3(std::sin(1.7 * i), std::sin(2.3 * i), std::sin(3.1 * i));
    fem::LinkFrames frames;
    frames.threads = threads;
    const double seconds = time_calls(threads > 1, quick, [&] { (void)fem::update_embedded_surface(*links, moved, body.dense.vertices, frames, out); });
    const auto vertices = static_cast<double>(links->vertex_count());
    return {{"name", body.name + " links"},
            {"vertices", links->vertex_count()},
            {"frames", links->frame_nodes.size()},
            {"ns_per_vertex", 1e9 * seconds / vertices},
            {"gb_per_s", 1e-9 * static_cast<double>(fem::embedded_update_bytes(*links)) / seconds},
            {"peer", false},
            {"isa", fem::chosen_isa()},
            {"precision", "double"},
            {"threads", threads},
            {"clock", threads > 1 ? "wall" : "cpu"}};
}

Body make_bench_bar(const char* name, std::array<Index, 3> cells) {
    Body body;
    body.name = name;
    body.mesh = fem::make_bar_mesh(cells, 0.4 / cells[0], 0.15);
    for (Index node = 0; node < body.mesh.vertices.size(); ++node)
        if (body.mesh.vertices[node][0] == 0.0) body.pinned.push_back(node);
    return body;
}

/// What a tet of the elastic neo-Hookean law takes: arithmetic of the AVX-512 code, counted in its disassembly (a fused multiply-add is
/// two), and bytes of its batch that the kernel reads.
constexpr double kFlopPerTet = 165.0;
constexpr double kBatchBytesPerTet = (sizeof(fem::TetBatch) - 9 * 8 * fem::kBatch) / double{fem::kBatch}; // all but Dm^-1

/// Bars from what fits in the first cache to what fits in none: where a plot over size bends, memory begins to bound.
Result<void> add_scaling(const BenchOptions& options, BenchTable& table) {
    const unsigned all = std::max(1u, std::thread::hardware_concurrency()), most = options.threads > 0 ? options.threads : all;
    std::vector<Index> across{2, 3, 6};
    if (!options.quick) across.insert(across.end(), {9, 13, 20, 28});
    std::string text;
    for (const Index n : across) {
        const Body bar = make_bench_bar("scaling", {4 * n, n, n});
        options.progress(fmt::format("scaling: {} tets", bar.mesh.tets.size()));
        const LawUnderTest &elastic = kTimedLaws[3], &viscous = kTimedLaws[0];
        fmt::format_to(std::back_inserter(text), "{}", bar.mesh.tets.size());
        for (const LawUnderTest* law : {&elastic, &viscous}) {
            const auto model = fem::make_tissue_model(bar.mesh, soft_material(*law), bar.pinned);
            if (!model) return model.error();
            for (unsigned threads = 1; threads <= most; threads += std::max(1u, most - 1)) { // one, then all
                BenchRow row = force_row(bar, *model, *law, threads, options.quick);
                const double ns = row["ns_per_tet"].get<double>();
                fmt::format_to(std::back_inserter(text), " {:.5g}", ns);
                if (law == &elastic) {
                    row["gflop_per_s"] = kFlopPerTet / ns;
                    row["batch_gb_per_s"] = kBatchBytesPerTet / ns;
                }
                table.rows.push_back(std::move(row));
            }
        }
        text += '\n';
    }
    Sketch sketch;
    sketch.plot = {"scaling",
                   "Time of a tetrahedron over the size of the mesh",
                   "Time of one force evaluation, per tetrahedron; double precision.",
                   {}};
    sketch.height += 50; // the names of four lines above the plot
    sketch.commands = "set logscale xy\nset format x '10^{%L}'\nset yrange [5:*]\nset ytics (5,10,20,50,100,200,500,1000)\nset xlabel "
                      "'number of tetrahedra' textcolor rgb '#4b5563' offset 0,0.4\n"
                      "set ylabel 'time a tetrahedron [ns]' textcolor rgb '#4b5563' offset 1,0\nset key outside top center maxcols 1 maxrows 4\nset tmargin 5.8\n"
                      "plot 'scaling.tsv' using 1:2 with linespoints pt 7 ps 0.6 lw 1.6 lc rgb '#2158d6' title 'neo-Hookean', "
                      "'' using 1:{} with linespoints pt 7 ps 0.6 lw 1.6 lc rgb '#d97706' title 'StVK, viscous'";
    sketch.commands.replace(sketch.commands.find("{}"), 2, most > 1 ? "4" : "3");
    if (most > 1)
        sketch.commands += fmt::format(", '' using 1:3 with linespoints pt 6 ps 0.6 lw 1.2 dt (6,4) lc rgb '#2158d6' title 'neo-Hookean, {0} threads', "
                                       "'' using 1:5 with linespoints pt 6 ps 0.6 lw 1.2 dt (6,4) lc rgb '#d97706' title 'StVK, viscous, {0} threads'",
                                       most);
    table.sketches.push_back(std::move(sketch));
    table.plot_data.push_back({"scaling.tsv", text});
    return {};
}

void write_peer_mesh(const std::filesystem::path& file, const TetMesh& mesh) {
    std::ofstream out(file, std::ios::binary);
    const std::uint64_t counts[2] = {mesh.vertices.size(), mesh.tets.size()};
    out.write(reinterpret_cast<const char*>(counts), sizeof counts);
    out.write(reinterpret_cast<const char*>(mesh.vertices.data()), static_cast<std::streamsize>(sizeof(Vec3) * mesh.vertices.size()));
    out.write(reinterpret_cast<const char*>(mesh.tets.data()), static_cast<std::streamsize>(sizeof(Tet) * mesh.tets.size()));
}

std::optional<BenchRow> bullet_row(const Body& body, bool quick, BenchTable& table) {
    const auto peer = find_peer("bullet_forces");
    if (!peer) {
        table.notes.push_back("bullet_forces was not built (package libbullet-dev): no peer beside " + body.name);
        return std::nullopt;
    }
    auto folder = TemporaryFolder::make();
    if (!folder.ok()) return std::nullopt;
    const auto file = folder->path() / "mesh.tets";
    write_peer_mesh(file, body.mesh);
    const double per_evaluation = 1e-9 * kBulletGuessNs * static_cast<double>(body.mesh.tets.size());
    const auto evaluations = std::max(5, static_cast<int>((quick ? 0.1 : 1.0) * kSampleSeconds / per_evaluation));
    const auto done = run_process(*peer, {file.string(), std::to_string(evaluations)}, folder->path(), kPeerSeconds);
    const auto answer = done.ok() ? nlohmann::json::parse(done->output, nullptr, false) : nlohmann::json();
    if (!answer.is_object() || !answer.contains("ns_per_tet")) {
        table.notes.push_back("bullet_forces gave no figure for " + body.name);
        return std::nullopt;
    }
    return BenchRow{{"name", body.name},
                    {"law", "neo_hookean (Bullet btDeformable)"},
                    {"viscous", false},
                    {"tets", body.mesh.tets.size()},
                    {"ns_per_tet", answer["ns_per_tet"]},
                    {"peer", true},
                    {"isa", "as packaged"},
                    {"precision", answer["precision"]},
                    {"threads", 1},
                    {"clock", "cpu"},
                    {"cpu_s_per_sim_s", nullptr},
                    {"integrator", "none"}};
}

/// The first deformable body of the main scene.
Result<std::optional<Body>> make_liver(const BenchOptions& options) {
    const Result<Scene> scene = read_scene(options.scene.empty() ? "assets/scenes/hepatic.json" : options.scene);
    if (!scene.ok()) return scene.error();
    const auto prepared = make_prepared_scene(*scene, [&](const std::string& what) { options.progress("preparing " + what); });
    if (!prepared.ok()) return prepared.error();
    for (const BodyModel& model : prepared->model.bodies) {
        if (!model.tissue) continue;
        Body body;
        body.name = model.name;
        body.mesh = {model.tissue->rest_position, model.tissue->tet_nodes};
        body.pinned = model.tissue->pinned;
        body.dense = model.surface;
        return std::optional(std::move(body));
    }
    return std::optional<Body>();
}

void add_link_rows(const Body& body, const fem::TissueModel& model, unsigned most, bool quick, BenchTable& table) {
    for (const std::string_view isa : {"avx512", "avx2", "portable"})
        if (fem::choose_isa(isa)) table.rows.push_back(link_row(body, model, 1, quick));
    fem::choose_isa("");
    if (most > 1) table.rows.push_back(link_row(body, model, most, quick));
}

Result<void> add_rows(const Body& body, const BenchOptions& options, BenchTable& table) {
    const unsigned all = std::max(1u, std::thread::hardware_concurrency());
    const unsigned most = options.threads > 0 ? options.threads : all;
    const bool small = body.mesh.tets.size() < 10000;
    for (const LawUnderTest& law : kTimedLaws) {
        options.progress(fmt::format("{}: {}", body.name, law.name));
        const auto model = fem::make_tissue_model(body.mesh, soft_material(law), body.pinned);
        if (!model.ok()) return model.error();
        for (const std::string_view isa : {"avx512", "avx2", "portable"}) {
            if (law.relaxing > 0.0) continue;        // its branches are the integrator's
            if (isa != "avx512" && !small) continue; // what the processor has
            if (!fem::choose_isa(isa)) continue;
            if (isa == "portable" && law.viscosity == 0.0) continue;
            table.rows.push_back(force_row(body, *model, law, 1, options.quick));
        }
        fem::choose_isa("");
        if (!fem::choose_isa("avx512") && !small && law.relaxing == 0.0) table.rows.push_back(force_row(body, *model, law, 1, options.quick));
        fem::choose_isa("");
        if (most > 1 && law.relaxing == 0.0) table.rows.push_back(force_row(body, *model, law, most, options.quick));
        if (law.viscosity > 0.0) continue;
        for (const fem::Integrator integrator : {fem::Integrator::Rk4, fem::Integrator::Leapfrog}) {
            table.rows.push_back(integrator_row(body, *model, law, integrator, kSwing, 1, options.quick));
            if (most > 1) table.rows.push_back(integrator_row(body, *model, law, integrator, kSwing, most, options.quick));
            if (small) table.rows.push_back(integrator_row(body, *model, law, integrator, kHang, 1, options.quick));
        }
        if (law.law == fem::MaterialLaw::NeoHookean && law.elements == fem::TetElements::Linear && !body.dense.triangles.empty())
            add_link_rows(body, *model, most, options.quick, table);
        if (law.law != fem::MaterialLaw::NeoHookean || law.elements != fem::TetElements::Linear) continue;
        if (auto row = bullet_row(body, options.quick, table)) { // right beside the law that it shares
            const BenchRow ours = force_row(body, *model, law, 1, options.quick);
            (*row)["times_ours"] = (*row)["ns_per_tet"].get<double>() / ours["ns_per_tet"].get<double>();
            (*row)["target_times"] = 6.0;
            table.rows.push_back(std::move(*row));
        }
    }
    return {};
}

} // namespace

Result<BenchTable> bench_fem(const BenchOptions& options) {
    BenchTable table;
    std::vector<Body> bodies{make_bench_bar("bar_5k", {24, 6, 6})};
    if (!options.quick) {
        bodies.push_back(make_bench_bar("bar_50k", {52, 13, 13}));
        bodies.push_back(make_bench_bar("bar_500k", {112, 28, 28}));
        auto liver = make_liver(options);
        if (!liver.ok()) return liver.error();
        if (*liver) bodies.push_back(std::move(**liver));
    }
    for (const Body& body : bodies)
        if (const auto added = add_rows(body, options, table); !added.ok()) return added.error();
    if (const auto added = add_scaling(options, table); !added.ok()) return added.error();
    table.notes.push_back(
        "ns_per_tet: one evaluation of all forces, median; under an integrator: its vector work and the derivation of the step included");
    table.notes.push_back("integrators: the body is held and falls from rest for a second; at 1 m/s^2 a bar swings by half its length, at "
                          "9.81 it hangs and stretches");
    table.notes.push_back(
        fmt::format("gflop_per_s, batch_gb_per_s: {:g} flop and {:g} bytes of batch a tet, and 64-byte nodes that neighbours share; "
                    "the rest of the AVX-512 loop's 450 instructions for 8 tets are 77 shuffles, 32 gathered loads, 32 sums into slots: "
                    "they bound it, not memory",
                    kFlopPerTet, kBatchBytesPerTet));
    table.notes.push_back("clock cpu: the thread's own time; wall where several threads work: other load on the machine shows in it");
    table.notes.push_back("Bullet computes elastic forces in float; times_ours compares with the same law in double, run just after it");
    return table;
}

} // namespace trocar::engine
