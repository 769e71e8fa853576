// How a step grows: time and memory over the size of walls, tissue, numbers of bodies and of instruments; each curve with its exponent and the
// one that is wanted of it.
#include "bench/whole_steps/growth_curve.hpp"
#include "bench/whole_steps/growth_scenes.hpp"
#include "bench/whole_steps/part_meter.hpp"
#include "bench/tables.hpp"
#include "engine/prepare/prepare_scene.hpp"
#include "engine/prepare/process.hpp"
#include "engine/report/statistics.hpp"
#include "engine/step/simulator.hpp"

#include <fmt/format.h>

#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <iterator>

namespace trocar::engine {

namespace {

constexpr double kWanted = 1.15;     // of whole steps, where only what is near the contact changes
constexpr double kWantedWall = 0.3;  // in the size of a wall that does not move

struct GrowthSubject {
    const char* name;
    const char* element;
    double wanted;
    unsigned warm_steps, steps;
    std::vector<std::size_t> sizes; // ascending; the first two are a quick run
    std::function<Result<GrownScene>(std::size_t, const std::filesystem::path&)> make;
};

std::vector<GrowthSubject> list_subjects() {
    using Folder = std::filesystem::path;
    const std::vector<std::size_t> walls{10'000, 50'000, 200'000, 1'000'000, 2'000'000}, wires{1, 2, 4, 8}, balls{1, 2, 4, 8, 16, 32, 64};
    return {{"static wall, more of it", "wall triangle", kWantedWall, 70, 50, walls, [](std::size_t n, const Folder& to) { return make_wall_scene(n, false, to); }},
            {"static wall, finer", "wall triangle", kWantedWall, 70, 50, walls, [](std::size_t n, const Folder& to) { return make_wall_scene(n, true, to); }},
            {"tissue", "tetrahedron", kWanted, 3, 12, {1'000, 5'000, 20'000, 100'000, 500'000}, [](std::size_t n, const Folder& to) { return make_tissue_scene(n, to); }},
            {"bodies apart", "body", kWanted, 10, 40, balls, [](std::size_t n, const Folder&) { return make_scattered_scene(n); }},
            {"bodies in a heap", "body", kWanted, 100, 40, balls, [](std::size_t n, const Folder&) { return make_heap_scene(n); }},
            {"instruments, a lumen each", "instrument", kWanted, 70, 50, wires, [](std::size_t n, const Folder&) { return make_instruments_scene(n, false); }},
            {"instruments in one lumen", "instrument", kWanted, 70, 50, wires, [](std::size_t n, const Folder&) { return make_instruments_scene(n, true); }}};
}

/// Bytes that the process holds, once what was freed is given back.
double resident_bytes() {
    malloc_trim(0);
    std::size_t all = 0, resident = 0;
    std::ifstream("/proc/self/statm") >> all >> resident;
    return static_cast<double>(resident) * static_cast<double>(sysconf(_SC_PAGESIZE));
}

/// Parts that a curve is told apart by. Exact contact is told by what lies in it.
struct ColumnOfPart {
    const char* key;
    const char* name;
    ProbedPart part;
};
constexpr ColumnOfPart kColumns[] = {{"prediction_ms", "prediction of instruments", ProbedPart::Prediction},
                                     {"tissue_ms", "tissue", ProbedPart::Tissue},
                                     {"impulses_ms", "impulses between solids", ProbedPart::Solver},
                                     {"surfaces_ms", "embedded surfaces", ProbedPart::Surfaces},
                                     {"trees_ms", "sphere trees", ProbedPart::Trees},
                                     {"descent_ms", "descent", ProbedPart::Descent},
                                     {"planes_ms", "planes of walls", ProbedPart::Planes},
                                     {"rods_ms", "rods solved", ProbedPart::RodSolve},
                                     {"tests_ms", "continuous tests", ProbedPart::Tests},
                                     {"solids_ms", "surfaces of solids", ProbedPart::Solids}};

Result<PreparedScene> prepare_grown(const GrownScene& grown) {
    const Result<Scene> scene = parse_scene(grown.text, "growth.json");
    if (!scene.ok()) return scene.error();
    return make_prepared_scene(*scene);
}

Result<BenchRow> measure_size(const GrowthSubject& subject, std::size_t size, bool quick, GrowthPoint& point) {
    auto folder = TemporaryFolder::make();
    if (!folder) return folder.error();
    auto grown = subject.make(size, folder->path());
    if (!grown) return grown.error();
    const double before = resident_bytes();
    auto prepared = prepare_grown(*grown);
    if (!prepared) return prepared.error();
    Simulator simulator(prepared->model, BudgetLimits{});
    const unsigned warm = quick ? 2 : subject.warm_steps, steps = quick ? 5 : subject.steps;
    const PerfCounters no_counters({});
    PartMeter meter(no_counters, warm + steps);
    simulator.set_probe(&meter);
    for (unsigned k = 0; k < warm + steps; ++k) {
        if (k == warm) meter.forget();
        if (const StepReport& report = simulator.step(); !report.finite)
            return Error{ErrorCode::BadValue, fmt::format("{}, {}: {}", subject.name, size, report.failure)};
        meter.end_step();
    }
    std::vector<double> whole = meter.whole_steps();
    point = {grown->elements, median(whole), resident_bytes() - before};
    const StepReport& last = simulator.report();
    BenchRow row{{"curve", subject.name}, {"element", subject.element}, {"elements", point.elements}, {"step_ms_p50", point.step_ms},
                 {"step_ms_p99", find_percentiles(whole).p99}};
    for (const ColumnOfPart& column : kColumns) row[column.key] = median(meter.of(column.part).ms);
    row["substeps"] = last.substeps;
    row["contacts"] = last.pressing_contacts + last.solid_touches + last.instrument_contacts;
    row["held_mb"] = 1e-6 * point.bytes;
    row["prepare_s"] = prepared->seconds;
    return row;
}

/// Which part is most of the largest size's step, and its own exponent: where a curve that grows too fast has it from.
/// rows   of one curve, by size
void add_largest_part(std::span<const BenchRow> rows, BenchRow& fit) {
    const auto ms = [](const BenchRow& row, const ColumnOfPart& column) {
        const double own = row[column.key];
        return column.part == ProbedPart::Tissue ? own - row["impulses_ms"].get<double>() : own;
    };
    const ColumnOfPart& most = *std::max_element(std::begin(kColumns), std::end(kColumns), [&](const ColumnOfPart& a, const ColumnOfPart& b) { return ms(rows.back(), a) < ms(rows.back(), b); });
    std::vector<GrowthPoint> points;
    for (const BenchRow& row : rows) points.push_back({row["elements"], ms(row, most), 0.0});
    fit["largest_part"] = most.name;
    fit["of_step"] = ms(rows.back(), most) / rows.back()["step_ms_p50"].get<double>();
    if (const auto exponent = fit_exponent(points)) fit["its_exponent"] = *exponent;
}

BenchRow fit_row(const GrowthSubject& subject, const std::vector<GrowthPoint>& points) {
    BenchRow row{{"curve", subject.name}, {"element", subject.element}, {"elements", points.back().elements}, {"smallest", points.front().elements}};
    if (const auto exponent = fit_exponent(points)) {
        row["exponent"] = *exponent;
        row["wanted"] = subject.wanted;
        row["met"] = *exponent <= subject.wanted;
    }
    if (const auto bytes = bytes_per_element(points)) row["bytes_per_element"] = *bytes;
    return row;
}

/// Time of a step over elements, a line a curve.
void sketch_curves(BenchTable& table) {
    Sketch sketch;
    sketch.plot = {"growth", "Time of a step over the number of elements", "Medians; both axes are logarithmic: a line's slope is the exponent.", {}};
    sketch.commands = "set logscale xy\nset format x '10^{%L}'\nset xlabel 'elements'\nset ylabel 'time of a step [ms]'\nset key outside right\nplot ";
    std::string curve, text;
    const auto end_curve = [&] {
        if (text.empty()) return;
        const std::string file = fmt::format("curve{}.tsv", table.plot_data.size());
        sketch.commands += fmt::format("'{}' using 1:2 with linespoints pt 7 title {}, ", file, quote_for_gnuplot(curve));
        table.plot_data.push_back({file, text, "elements,step_ms"});
        text.clear();
    };
    for (const BenchRow& row : table.rows) {
        if (!row.contains("step_ms_p50")) continue;
        if (row["curve"] != curve) end_curve();
        curve = row["curve"];
        text += fmt::format("{}\t{:.6g}\n", row["elements"].get<std::size_t>(), row["step_ms_p50"].get<double>());
    }
    end_curve();
    table.sketches.push_back(std::move(sketch));
}

} // namespace

Result<BenchTable> bench_growth(const BenchOptions& options) {
    BenchTable table;
    for (const GrowthSubject& subject : list_subjects()) {
        std::vector<GrowthPoint> points;
        for (const std::size_t size : subject.sizes) {
            if (options.quick && points.size() == 2) break;
            options.progress(fmt::format("{}: {}", subject.name, size));
            auto row = measure_size(subject, size, options.quick, points.emplace_back());
            if (!row) return row.error();
            table.rows.push_back(std::move(*row));
        }
        BenchRow fit = fit_row(subject, points);
        add_largest_part(std::span(table.rows).last(points.size()), fit);
        table.rows.push_back(std::move(fit));
    }
    sketch_curves(table);
    table.notes.push_back("step: processor time of the whole of it, everything tested (exact), one thread; exponent: slope of log time over log elements by least squares, all sizes");
    table.notes.push_back("held: memory of the process with the prepared scene, state and scratch, less that before, pages that are freed given back; "
                          "bytes_per_element: from the smallest to the largest size");
    return table;
}

} // namespace trocar::engine
