// Set-based culling on the scenes of its paper: what each stage costs and leaves, beside an AABB hierarchy and the paper's figures.
#include "collision/contact_search.hpp"
#include "engine/bench/contact_workloads.hpp"
#include "engine/bench/tables.hpp"
#include "engine/gpu/culled_search.hpp"
#include "engine/gpu/gl_cull_backend.hpp"
#include "engine/time/clock.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace seldinger::engine {

namespace {

using collision::ContactSearch;
using collision::SurfaceMotion;
using collision::SurfaceTopology;

struct Workload {
    const char* name;
    FrameSequence frames;
    const char* paper_ms; // per step, Govindaraju et al. 2005: Pentium IV 3.4 GHz, GeForce 6800
    const char* paper_sets;
};

/// Rows of steps become medians by name.
class Medians {
public:
    void add(const std::string& name, double value) {
        for (auto& [known, values] : columns_)
            if (known == name) {
                values.push_back(value);
                return;
            }
        columns_.push_back({name, {value}});
    }
    [[nodiscard]] double of(const std::string& name) const {
        for (const auto& [known, values] : columns_)
            if (known == name) {
                std::vector<double> sorted = values;
                std::sort(sorted.begin(), sorted.end());
                return sorted[sorted.size() / 2];
            }
        return 0.0;
    }
    void write(BenchRow& row) const {
        for (const auto& [name, values] : columns_) row[name] = of(name);
    }

private:
    std::vector<std::pair<std::string, std::vector<double>>> columns_;
};

/// The last steps of a sequence: folded cloth, a catheter far inside.
struct Steps {
    std::size_t first, last;
};

BenchRow start_row(const Workload& work, const SurfaceTopology& surface, const std::string& method) {
    return {{"scene", work.name}, {"triangles", surface.triangles.size()}, {"method", method}};
}

void end_row(BenchRow& row, const Workload& work, double hierarchy_ms, double total_ms) {
    row["times_faster_than_aabb"] = total_ms > 0.0 ? hierarchy_ms / total_ms : 0.0;
    row["paper_ms"] = work.paper_ms;
    row["paper_sets"] = work.paper_sets;
}

/// The hierarchy alone: boxes of three axes, two children, as the paper compares with.
BenchRow run_hierarchy(const Workload& work, const SurfaceTopology& surface, const Steps& steps, double& total_ms) {
    ContactSearch search;
    const SurfaceTopology* surfaces[] = {&surface};
    const std::span<const Vec3> positions[] = {work.frames.frame(0)};
    collision::SearchOptions options;
    options.tree.dop = 6;
    search.build(surfaces, positions, options);
    Medians medians;
    std::vector<collision::SearchContact> found;
    for (std::size_t k = steps.first; k < steps.last; ++k) {
        const SurfaceMotion motion[] = {{&surface, work.frames.frame(k), work.frames.frame(k + 1)}};
        StopWatch watch;
        search.refit(motion);
        medians.add("refit_ms", watch.lap_ms());
        search.find_candidates();
        medians.add("near_ms", watch.lap_ms());
        search.decide(found);
        medians.add("tests_ms", watch.lap_ms());
        medians.add("tests", static_cast<double>(search.stats().candidates_vf + search.stats().candidates_ee));
        medians.add("hits", static_cast<double>(search.stats().hits_vf + search.stats().hits_ee));
    }
    BenchRow row = start_row(work, surface, "AABB hierarchy");
    medians.write(row);
    total_ms = medians.of("refit_ms") + medians.of("near_ms") + medians.of("tests_ms");
    row["total_ms"] = total_ms;
    end_row(row, work, total_ms, total_ms);
    return row;
}

BenchRow run_sets(const Workload& work, const SurfaceTopology& surface, const Steps& steps, const std::string& name,
                  const CulledSearch::Options& options, double hierarchy_ms, std::vector<std::string>& notes) {
    const SurfaceTopology* surfaces[] = {&surface};
    const std::span<const Vec3> positions[] = {work.frames.frame(0)};
    StopWatch preparing;
    CulledSearch culled(surfaces, positions, options);
    const double prepare_ms = preparing.lap_ms();
    ContactSearch search;
    search.build(surfaces, positions, {});
    Medians medians;
    std::vector<collision::SearchContact> found;
    for (std::size_t k = steps.first; k < steps.last; ++k) {
        const SurfaceMotion motion[] = {{&surface, work.frames.frame(k), work.frames.frame(k + 1)}};
        const CullTimes times = culled.find_candidates(motion);
        search.start_given(motion);
        const auto& job = culled.jobs().front();
        search.give_candidates(0, 0, job.candidates.vertex_face, job.candidates.face_vertex, job.candidates.edge_edge);
        StopWatch watch;
        search.decide(found);
        const double tests_ms = watch.lap_ms();
        culled.note_tests(tests_ms);
        const collision::CullCounts& counts = job.culler->counts();
        medians.add("refit_ms", times.refit_ms);
        medians.add("near_ms", times.near_ms);
        medians.add("look_ms", times.look_ms);
        medians.add("collect_ms", times.collect_ms);
        medians.add("tests_ms", tests_ms);
        medians.add("tests", static_cast<double>(search.stats().candidates_vf + search.stats().candidates_ee));
        medians.add("hits", static_cast<double>(search.stats().hits_vf + search.stats().hits_ee));
        medians.add("pcs_after_I", static_cast<double>(counts.near_triangles));
        medians.add("pcs_after_II", static_cast<double>(counts.left_triangles));
        medians.add("pairs_after_I", static_cast<double>(counts.near_pairs));
        medians.add("pairs_after_II", static_cast<double>(counts.left_pairs));
    }
    BenchRow row = start_row(work, surface, name);
    medians.write(row);
    const double total =
        medians.of("refit_ms") + medians.of("near_ms") + medians.of("look_ms") + medians.of("collect_ms") + medians.of("tests_ms");
    row["total_ms"] = total;
    if (total > 0.0) {
        row["share_I"] = (medians.of("refit_ms") + medians.of("near_ms")) / total;
        row["share_II"] = medians.of("look_ms") / total;
        row["share_tests"] = medians.of("tests_ms") / total;
    }
    row["colours"] = culled.colours();
    row["prepare_ms"] = prepare_ms;
    row["culler"] = culled.backend();
    end_row(row, work, hierarchy_ms, total);
    for (const std::string& note : culled.notes())
        if (std::find(notes.begin(), notes.end(), note) == notes.end()) notes.push_back(note);
    return row;
}

std::vector<Workload> make_workloads(bool quick) {
    std::vector<Workload> all;
    const std::size_t steps = kFoldSteps;
    const FoldPart part{steps / 2, quick ? std::size_t{2} : std::size_t{6}};
    all.push_back({"skirt 13K", make_folding_cloth(81, 80, part), "400-500", ""});
    if (quick) return all;
    all.push_back({"cloth 23K", make_folding_cloth(107, 107, part), "400-550", "19"});
    all.push_back({"one curtain of 32.5K", make_folding_cloth(127, 128, part), "100", "10"});
    all.push_back({"catheter 10K + vessel 83K", make_bending_artery(0.608e-3, 5), "60-90", ""});
    return all;
}

} // namespace

Result<BenchTable> bench_chromatic(const BenchOptions& options) {
    BenchTable table;
    const auto gl = GlCullBackend::make();
    const bool hardware = gl.ok() && !(*gl)->is_software();
    table.notes.push_back(gl.ok() ? fmt::format("OpenGL: {}", (*gl)->name()) : "no OpenGL: " + gl.error().message);
    if (gl.ok() && !hardware)
        table.notes.push_back("OpenGL is drawn by software here: its rows are for the answers, and on the smallest scene alone");
    for (const Workload& work : make_workloads(options.quick)) {
        const SurfaceTopology surface = collision::make_topology(work.frames.triangles, work.frames.vertex_count());
        const std::size_t count = work.frames.frame_count - 1;
        const Steps steps{0, count};
        options.progress(fmt::format("{}: hierarchy", work.name));
        double hierarchy_ms = 0.0;
        table.rows.push_back(run_hierarchy(work, surface, steps, hierarchy_ms));
        const auto sets = [&](const std::string& name, CullMethod method, const collision::CullPlan& plan) {
            options.progress(fmt::format("{}: {}", work.name, name));
            table.rows.push_back(
                run_sets(work, surface, steps, name, {.method = method, .plan = plan, .contexts = {}}, hierarchy_ms, table.notes));
        };
        sets("sets, without II", CullMethod::None, {});
        sets("sets, II with intervals", CullMethod::Cpu, {});
        sets("sets, II with fronts", CullMethod::Cpu, {.memory = collision::CullMemory::Fronts});
        if (!options.quick) sets("sets, II in one round", CullMethod::Cpu, {.max_rounds = 1});
        sets("sets, II where it pays", CullMethod::Auto, {});
        if (hardware || (gl.ok() && surface.triangles.size() < 14000))
            sets("sets, II by OpenGL", CullMethod::Gl, {.resolution = hardware ? 0 : 128, .max_rounds = 1});
    }
    table.notes.push_back("paper: cloth of 12,296 triangles: 6,442 left after I, 524 after II, 65K elementary tests without II and 2,737 "
                          "with it; I 40-50 % of "
                          "the time, II 35-45 %, tests below 10 %; 5 times faster than AABB trees without II, 15-20 times with it");
    table.notes.push_back(
        "the hierarchy's rows: three axes, eight children, SIMD; tests are exact verdicts, where the paper's are interval arithmetic");
    return table;
}

} // namespace seldinger::engine
