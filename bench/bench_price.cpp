// What accuracy costs in time: shipped scenes under budgets from nothing to no limit, each against its exact run.
#include "bench/bench_scene.hpp"
#include "bench/tables.hpp"
#include "engine/experiments/cost_run.hpp"
#include "engine/prepare/prepare_scene.hpp"
#include "engine/report/plot_html.hpp"
#include "engine/scene/settings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

namespace trocar::engine {

namespace {

constexpr std::uint64_t kSteps = 80, kQuickSteps = 8;
constexpr const char* kBudgets[] = {"work:0", "0.5ms", "1ms", "2ms", "4ms", "8ms", "exact"};
constexpr const char* kQuickBudgets[] = {"work:0", "2ms", "exact"};
constexpr double kNoTime = 1e-6; // ms: the least that a logarithmic axis shows

BenchRow row_of(const std::string& scene, const CostRow& row, double exact_ms) {
    return {{"scene", scene},
            {"budget", row.budget.name},
            {"charged_ms_p50", row.charged_ms.p50},
            {"charged_of_exact", exact_ms > 0.0 ? row.charged_ms.p50 / exact_ms : 1.0},
            {"step_ms_p50", row.step_ms.p50},
            {"budget_kept", row.budget_kept},
            {"missed", row.contacts.missed},
            {"unseen", row.contacts.unseen},
            {"false", row.contacts.spurious},
            {"depth_error_mm", 1e3 * row.depth_error_rms_m()},
            {"force_error", row.force_error_rel},
            {"step_rms_mm", 1e3 * row.surface.rms()},
            {"step_hausdorff_mm", 1e3 * row.surface.hausdorff},
            {"run_rms_mm", 1e3 * row.trajectory.rms()},
            {"run_hausdorff_mm", 1e3 * row.trajectory.hausdorff},
            {"tip_mm", 1e3 * row.tip_distance_rms_m},
            {"failure", row.failure}};
}

/// Error of the run over what its step was charged, a line a scene. Where no run has an error, none.
void sketch_frontiers(BenchTable& table) {
    double least = std::numeric_limits<double>::infinity();
    for (const BenchRow& row : table.rows)
        if (const double error = row["run_rms_mm"].get<double>(); error > 0.0) least = std::min(least, error);
    if (!std::isfinite(least)) return;
    const double zero = zero_on_logarithmic_axis(least);
    Sketch sketch;
    sketch.plot = {"price", "What accuracy costs",
                   "Root mean square distance of the surfaces from the exact run's, each run by itself, over the median of what a step was "
                   "charged. What equals the exact run to the last bit stands at the tick 0. The leftmost point of a line is what is charged under a budget of nothing: the floor.",
                   {}};
    sketch.commands = fmt::format("set logscale xy\nset format '10^{{%L}}'\nset xlabel 'charged for contact [ms a step]'\nset ylabel 'distance from the "
                                  "exact run [mm]'\nset ytics add ('0' {:.6g})\nset offsets graph 0.1, graph 0.1, graph 0.1, graph 0.1\nset key outside "
                                  "right\nplot ",
                                  zero);
    std::vector<std::string> scenes;
    for (const BenchRow& row : table.rows)
        if (std::find(scenes.begin(), scenes.end(), row["scene"]) == scenes.end()) scenes.push_back(row["scene"]);
    for (const std::string& scene : scenes) {
        std::string text;
        for (const BenchRow& row : table.rows)
            if (row["scene"] == scene)
                fmt::format_to(std::back_inserter(text), "{:.6g}\t{:.6g}\n", std::max(row["charged_ms_p50"].get<double>(), kNoTime),
                               std::max(row["run_rms_mm"].get<double>(), zero));
        table.plot_data.push_back({scene + ".tsv", text, "charged_ms,error_mm_or_place_of_zero"});
        sketch.commands += fmt::format("'{}.tsv' using 1:2 with linespoints pt 7 title {}, ", scene, quote_for_gnuplot(scene));
    }
    table.sketches.push_back(std::move(sketch));
}

} // namespace

Result<BenchTable> bench_price(const BenchOptions& options) {
    BenchTable table;
    std::vector<std::filesystem::path> files{"assets/scenes/two_organs.json", "assets/scenes/heap.json",         "assets/scenes/spikes.json",
                                             "assets/scenes/hepatic.json",    "assets/scenes/hepatic_fine.json", "assets/scenes/two_devices.json",
                                             "assets/scenes/guidewire.json"};
    if (!options.scene.empty()) files = {options.scene};
    if (options.quick && options.scene.empty()) files = {"assets/scenes/falling_sphere.json"};
    for (const std::filesystem::path& file : files) {
        const auto ready = prepare_for_bench(file, options, table);
        if (!ready.ok()) return ready.error();
        const Scene& scene = ready->scene;
        const SceneModel& model = ready->prepared.model;
        CostOptions cost;
        for (const char* budget : options.quick ? std::span<const char* const>(kQuickBudgets) : std::span<const char* const>(kBudgets))
            cost.budgets.push_back({budget, parse_budget(budget)->limits});
        const auto stretch = choose_stretch(model, scene.cost.from, std::nullopt, options.quick ? kQuickSteps : kSteps);
        if (!stretch.ok()) return stretch.error();
        cost.from = stretch->from, cost.steps = stretch->steps;
        cost.progress = [&](const std::string& what) { options.progress(scene.name + ": " + what); };
        const auto measured = measure_cost(ready->prepared, scene.cost, cost);
        if (!measured.ok()) return measured.error();
        const double exact_ms = measured->rows.back().charged_ms.p50;
        for (const CostRow& row : measured->rows) table.rows.push_back(row_of(scene.name, row, exact_ms));
        if (measured->from > 0) table.notes.push_back(fmt::format("{}: compared{}", scene.name, start_text(*measured, model.step_s)));
        for (const std::string& notice : measured->notices) table.notes.push_back(scene.name + ": " + notice);
    }
    sketch_frontiers(table);
    table.notes.push_back("charged: what the budget for collision took of a step, finding, solving and holding of contact included; missed, false, "
                          "depth, force, step: the answer in a step from the exact run's state; run, tip: where a run by itself diverged to");
    return table;
}

} // namespace trocar::engine
