// Is the budget kept? The same scene under budgets from 0.1 to 33 ms: what each step was charged, beside its limit. What the
// operating system took from the thread is told apart: wall time beside the thread's own.
#include "engine/bench/tables.hpp"
#include "engine/observe/statistics.hpp"
#include "engine/prepare/prepare_scene.hpp"
#include "engine/step/simulator.hpp"
#include "engine/time/clock.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace seldinger::engine {

namespace {

constexpr std::array kBudgetsMs{0.1, 0.3, 1.0, 3.0, 10.0, 33.0};
/// A step counts as kept within this: the clock is read between grants, not inside them. Absolute or relative, whichever
/// is more.
constexpr double kGraceMs = 0.05, kGraceShare = 0.05;

double percentile(const std::vector<double>& sorted, double share) {
    return sorted[std::min(sorted.size() - 1, static_cast<std::size_t>(share * static_cast<double>(sorted.size())))];
}

BenchRow run_under(const SceneModel& scene_model, double budget_ms, std::uint64_t steps) {
    SceneModel model = scene_model;
    model.budget = {.mode = BudgetMode::Wall, .wall_s = 1e-3 * budget_ms};
    Simulator simulator(model);
    std::vector<double> charged;
    charged.reserve(steps);
    std::uint64_t kept = 0, exact = 0, insisted = 0, exits = 0;
    const std::int64_t wall_begin = monotonic_ns(), thread_begin = thread_cpu_ns();
    for (std::uint64_t k = 0; k < steps; ++k) {
        const StepReport& report = simulator.step();
        if (!report.finite) break;
        charged.push_back(report.ms.budget);
        kept += report.ms.budget <= budget_ms + std::max(kGraceMs, kGraceShare * budget_ms) ? 1 : 0;
        exact += report.exact_ran ? 1 : 0;
        insisted += report.exact_insisted ? 1 : 0;
        exits += report.lumen_exits;
    }
    const auto wall = static_cast<double>(monotonic_ns() - wall_begin);
    const auto thread = static_cast<double>(thread_cpu_ns() - thread_begin);
    std::sort(charged.begin(), charged.end());
    if (charged.empty()) charged.push_back(0.0);
    return {{"budget_ms", budget_ms},
            {"steps", charged.size()},
            {"kept", static_cast<double>(kept) / static_cast<double>(charged.size())},
            {"charged_ms_p50", percentile(charged, 0.5)},
            {"charged_ms_p99", percentile(charged, 0.99)},
            {"charged_ms_p999", percentile(charged, 0.999)},
            {"charged_ms_worst", charged.back()},
            {"exact_steps", exact},
            {"exact_insisted", insisted},
            {"lumen_exits", exits},
            {"stolen_share", wall > 0.0 ? std::max(0.0, 1.0 - thread / wall) : 0.0}};
}

} // namespace

Result<BenchTable> bench_deadline(const BenchOptions& options) {
    const std::filesystem::path file = options.scene.empty() ? "assets/scenes/hepatic.json" : options.scene;
    const Result<Scene> scene = read_scene(file);
    if (!scene.ok()) return scene.error();
    const auto prepared = prepare_scene(*scene, [&](const std::string& what) { options.progress("preparing " + what); });
    if (!prepared.ok()) return prepared.error();
    BenchTable table;
    const std::uint64_t steps = options.quick ? 20 : prepared->model.step_count;
    for (const double budget_ms : kBudgetsMs) {
        options.progress(fmt::format("{} steps under {} ms", steps, budget_ms));
        table.rows.push_back(run_under(prepared->model, budget_ms, steps));
    }
    table.notes.push_back(fmt::format("kept: charged <= budget + the larger of {} ms and {} % of it", kGraceMs, 100.0 * kGraceShare));
    table.notes.push_back("exact_insisted: steps that went over on purpose, because the instrument would have left the lumen");
    return table;
}

} // namespace seldinger::engine
