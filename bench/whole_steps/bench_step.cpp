// Where the time of a step goes: its parts in time and hardware counters, and what their bytes and arithmetic reach of this machine's roofline.
#include "bench/whole_steps/part_meter.hpp"
#include "bench/whole_steps/roofline.hpp"
#include "bench/whole_steps/step_work.hpp"
#include "bench/bench_scene.hpp"
#include "bench/tables.hpp"
#include "engine/prepare/prepare_scene.hpp"
#include "engine/report/statistics.hpp"
#include "engine/step/simulator.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace trocar::engine {

namespace {

constexpr std::int64_t kSceneNs = 22'000'000'000; // of processor time, whatever a scene still has to do then
constexpr std::size_t kWarmSteps = 20, kQuickSteps = 30;

struct PartName {
    ProbedPart part;
    const char* name;
    const char* within; // empty: one of those that are the step
};
constexpr PartName kPartNames[] = {{ProbedPart::Script, "script", ""},
                                   {ProbedPart::Prediction, "prediction of instruments", ""},
                                   {ProbedPart::Tissue, "tissue", ""},
                                   {ProbedPart::Solver, "impulses between solids", "tissue"},
                                   {ProbedPart::Surfaces, "embedded surfaces", ""},
                                   {ProbedPart::Trees, "sphere trees", ""},
                                   {ProbedPart::Descent, "descent", ""},
                                   {ProbedPart::Exact, "exact contact", ""},
                                   {ProbedPart::Instruments, "response of instruments", ""},
                                   {ProbedPart::Walls, "walls followed", "exact contact, response"},
                                   {ProbedPart::Planes, "planes of walls", "exact contact, response"},
                                   {ProbedPart::RodSolve, "rods solved", "exact contact, response"},
                                   {ProbedPart::Skin, "boxes of skins", "exact contact"},
                                   {ProbedPart::Tests, "continuous tests", "exact contact"},
                                   {ProbedPart::Solids, "surfaces of solids", ""}};
static_assert(std::size(kPartNames) == kProbedParts);

/// A scene's steps.
struct StepRun {
    std::size_t steps = 0; // without the first ones
    double tissue_bytes = 0.0, tissue_flops = 0.0, surface_bytes = 0.0, surface_flops = 0.0; // all steps together
    std::size_t tissue_set = 0, surface_set = 0;
    bool tissue_known = true, surface_known = true;
};

void add_work(const Simulator& simulator, const StepReport& report, StepRun& run) {
    const auto add = [](const std::optional<PartWork>& work, double& bytes, double& flops, std::size_t& set, bool& known) {
        known = known && work.has_value();
        if (!work) return;
        bytes += work->bytes, flops += work->flops;
        set = std::max(set, work->working_set);
    };
    add(find_tissue_work(simulator.model(), report.tet_evaluations), run.tissue_bytes, run.tissue_flops, run.tissue_set, run.tissue_known);
    add(find_surface_work(simulator.model(), simulator.raw_state()), run.surface_bytes, run.surface_flops, run.surface_set, run.surface_known);
}

StepRun take_steps(const SceneModel& model, PartMeter& meter, std::size_t steps) {
    Simulator simulator(model, BudgetLimits{}); // everything is tested: what a step does depends on no clock
    simulator.set_probe(&meter);
    StepRun run;
    const std::int64_t begin = thread_cpu_ns();
    for (std::size_t k = 0; k < steps && thread_cpu_ns() - begin < kSceneNs; ++k) {
        const StepReport& report = simulator.step();
        if (!report.finite) break;
        meter.end_step();
        if (k < kWarmSteps) {
            meter.forget();
            continue;
        }
        ++run.steps;
        add_work(simulator, report, run);
    }
    return run;
}

double mean(const std::vector<double>& values) {
    double sum = 0.0;
    for (const double value : values) sum += value;
    return values.empty() ? 0.0 : sum / static_cast<double>(values.size());
}

/// What its bytes and arithmetic come to, per step and second; nothing where they are unknown.
void add_roof(BenchRow& row, const Roofline& roofline, double ms, std::size_t steps, double bytes, double flops, std::size_t set, bool known) {
    if (!known || steps == 0 || !(ms > 0.0) || !(bytes > 0.0)) return;
    const double per_step = 1.0 / static_cast<double>(steps), gflops = 1e-6 * flops * per_step / ms, roof = roofline.roof(flops / bytes, set);
    row["mb"] = 1e-6 * bytes * per_step;
    row["mflop"] = 1e-6 * flops * per_step;
    row["flop_per_byte"] = flops / bytes;
    row["gflop_per_s"] = gflops;
    row["works_from"] = roofline.level_of(set).name;
    row["roof_gflop_per_s"] = roof;
    row["bound_by"] = roof < roofline.peak_gflops ? "bandwidth" : "arithmetic";
    row["of_roof"] = gflops / roof;
}

void add_counters(BenchRow& row, const PartSamples& part, std::size_t steps) {
    const double per_step = steps > 0 ? 1.0 / static_cast<double>(steps) : 0.0;
    row["minstructions"] = 1e-6 * static_cast<double>(part.counted[0]) * per_step;
    row["instructions_per_cycle"] = part.counted[1] > 0 ? static_cast<double>(part.counted[0]) / static_cast<double>(part.counted[1]) : 0.0;
    row["kmisses"] = 1e-3 * static_cast<double>(part.counted[2]) * per_step;
}

BenchRow row_of_part(const std::string& scene, const PartName& name, const PartSamples& part, double whole_ms) {
    std::vector<double> ms = part.ms;
    const double average = mean(ms);
    const Percentiles times = find_percentiles(ms);
    return {{"scene", scene}, {"part", name.name}, {"within", name.within}, {"ms_p50", times.p50}, {"ms_p99", times.p99},
            {"ms_mean", average}, {"of_step", whole_ms > 0.0 ? average / whole_ms : 0.0}, {"times_a_step", ms.empty() ? 0.0 : static_cast<double>(part.times) / static_cast<double>(ms.size())}};
}

void add_scene(BenchTable& table, const std::string& scene, const StepRun& run, const PartMeter& meter, const Roofline& roofline, bool counts) {
    std::vector<double> whole = meter.whole_steps();
    const double average = mean(whole);
    const Percentiles times = find_percentiles(whole);
    table.rows.push_back({{"scene", scene}, {"part", "step"}, {"within", ""}, {"ms_p50", times.p50}, {"ms_p99", times.p99}, {"ms_mean", average},
                          {"of_step", 1.0}, {"times_a_step", 1.0}, {"steps", run.steps}});
    for (const PartName& name : kPartNames) {
        const PartSamples& part = meter.of(name.part);
        if (part.times == 0) continue;
        BenchRow row = row_of_part(scene, name, part, average);
        const double ms = row["ms_mean"];
        if (counts) add_counters(row, part, run.steps);
        if (name.part == ProbedPart::Tissue) // its own loops: impulses between solids are another matter
            add_roof(row, roofline, ms - mean(meter.of(ProbedPart::Solver).ms), run.steps, run.tissue_bytes, run.tissue_flops, run.tissue_set, run.tissue_known);
        if (name.part == ProbedPart::Surfaces)
            add_roof(row, roofline, ms, run.steps, run.surface_bytes, run.surface_flops, run.surface_set, run.surface_known);
        table.rows.push_back(std::move(row));
    }
}

void add_roofline(BenchTable& table, const Roofline& roofline) {
    for (const MemoryLevel& level : roofline.levels)
        table.rows.push_back({{"scene", "roofline"}, {"part", "triad, " + level.name}, {"gb_per_s", level.gb_per_s}, {"array_mb", 1e-6 * static_cast<double>(level.bytes)}});
    table.rows.push_back({{"scene", "roofline"}, {"part", "fused multiply-adds"}, {"roof_gflop_per_s", roofline.peak_gflops}});
}

/// us; of two readings, which every part has.
double reading_cost_us(const PerfCounters& counters) {
    constexpr int kReadings = 1000;
    const std::int64_t begin = thread_cpu_ns();
    std::int64_t end = begin;
    for (int k = 0; k < kReadings; ++k) {
        (void)counters.read();
        end = thread_cpu_ns();
    }
    return 2e-3 * static_cast<double>(end - begin) / kReadings;
}

void add_notes(BenchTable& table, const PerfCounters& counters) {
    table.notes.push_back("ms: the thread's own processor time, of steps without a budget, in which everything is tested; mean, of_step: by the mean over steps, where parts add up to a step; those within others lie in their time too");
    if (!counters.counts()) table.notes.push_back(counters.refusal());
    table.notes.push_back(fmt::format("a part's two readings take {:.2g} us, which lie outside of its own time but inside that of the part around it", reading_cost_us(counters)));
    table.notes.push_back("mb, mflop: of one step, counted from the model: forces of tetrahedra with node updates, in the tissue's time without impulses between solids, and surfaces that follow links; of a part "
                          "without them they are unknown. of_roof: of what bandwidth of the level that holds the part's arrays, or arithmetic, allows at most");
}

} // namespace

Result<BenchTable> bench_step(const BenchOptions& options) {
    BenchTable table;
    std::vector<std::filesystem::path> files{"assets/scenes/hepatic.json", "assets/scenes/aortic_arch.json", "assets/scenes/two_organs.json", "assets/scenes/heap.json"};
    if (options.quick) files = {"assets/scenes/falling_sphere.json"};
    if (!options.scene.empty()) files = {options.scene};
    options.progress("roofline");
    const Roofline roofline = measure_roofline(options.quick);
    const PerfCounters counters(hardware_events());
    for (const std::filesystem::path& file : files) {
        const auto ready = prepare_for_bench(file, options, table);
        if (!ready.ok()) return ready.error();
        const Scene& scene = ready->scene;
        const SceneModel& model = ready->prepared.model;
        const std::size_t steps = options.quick ? kWarmSteps + kQuickSteps : model.step_count;
        options.progress(fmt::format("{}: at most {} steps", scene.name, steps));
        PartMeter meter(counters, steps);
        const StepRun run = take_steps(model, meter, steps);
        add_scene(table, scene.name, run, meter, roofline, counters.counts());
    }
    add_roofline(table, roofline);
    add_notes(table, counters);
    return table;
}

} // namespace trocar::engine
