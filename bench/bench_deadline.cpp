// Is the budget kept? The same scene under budgets from 0.1 to 33 ms: what each step was charged, beside its limit. What the
// operating system took from the thread is told apart: wall time beside the thread's own.
#include "bench/bench_scene.hpp"
#include "bench/tables.hpp"
#include "engine/report/statistics.hpp"
#include "engine/prepare/prepare_scene.hpp"
#include "engine/state/state.hpp"
#include "engine/step/simulator.hpp"
#include "engine/time/clock.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace trocar::engine {

namespace {

constexpr std::array kBudgetsMs{0.1, 0.3, 1.0, 3.0, 10.0, 33.0};
constexpr std::uint64_t kFirstSteps = 20, kMeetingSteps = 600; // of scenes beside the first: instruments that meet
/// A step counts as kept within this: the clock is read between grants, not inside them. Absolute or relative, whichever
/// is more.
constexpr double kGraceMs = 0.05, kGraceShare = 0.05;

double percentile(std::vector<double>& values, double share) {
    std::sort(values.begin(), values.end());
    if (values.empty()) return 0.0;
    return values[std::min(values.size() - 1, static_cast<std::size_t>(share * static_cast<double>(values.size())))];
}

/// Steps under one budget, what each was charged by the clock and by the thread's own.
struct Charges {
    std::vector<double> wall_ms, own_ms, stolen_ms;
    std::uint64_t kept = 0, kept_own = 0, fitting = 0, fitting_kept = 0;
    std::uint64_t exact = 0, abandoned = 0, forced_exact = 0, exits = 0;
    double open_pairs = 0.0;

    void add(const StepReport& report, double budget_ms) {
        const double limit = budget_ms + std::max(kGraceMs, kGraceShare * budget_ms);
        const double stolen = std::max(0.0, report.ms.budget - report.ms.budget_cpu);
        const bool in_time = report.ms.budget <= limit, in_own_time = report.ms.budget - stolen <= limit;
        wall_ms.push_back(report.ms.budget);
        own_ms.push_back(report.ms.budget - stolen);
        stolen_ms.push_back(stolen);
        kept += in_time;
        kept_own += in_own_time;
        if (!report.exact_forced) { // its mandatory part fitted
            ++fitting;
            fitting_kept += in_own_time;
        }
        exact += report.exact_ran;
        abandoned += report.exact_abandoned;
        forced_exact += report.exact_forced;
        exits += report.lumen_exits;
        open_pairs += static_cast<double>(report.pairs_open);
    }
};

double kept_share(std::uint64_t part, std::uint64_t whole) { return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole) : 1.0; }

BenchRow run_under(const std::string& scene, const SceneModel& model, double budget_ms, std::uint64_t steps) {
    Simulator simulator(model, BudgetLimits{.mode = BudgetMode::Wall, .wall_s = 1e-3 * budget_ms});
    Charges charges;
    for (std::uint64_t k = 0; k < steps; ++k) {
        const StepReport& report = simulator.step();
        if (!report.finite) break;
        charges.add(report, budget_ms);
    }
    const std::uint64_t done = charges.wall_ms.size();
    return {{"scene", scene},
            {"budget_ms", budget_ms},
            {"steps", done},
            {"kept", kept_share(charges.kept, done)},
            {"kept_own_time", kept_share(charges.kept_own, done)},
            {"kept_where_it_fits", kept_share(charges.fitting_kept, charges.fitting)},
            {"charged_ms_p50", percentile(charges.wall_ms, 0.5)},
            {"charged_ms_p99", percentile(charges.wall_ms, 0.99)},
            {"charged_ms_p999", percentile(charges.wall_ms, 0.999)},
            {"charged_ms_worst", percentile(charges.wall_ms, 1.0)},
            {"own_ms_p999", percentile(charges.own_ms, 0.999)},
            {"own_ms_worst", percentile(charges.own_ms, 1.0)},
            {"stolen_ms_p99", percentile(charges.stolen_ms, 0.99)},
            {"stolen_ms_worst", percentile(charges.stolen_ms, 1.0)},
            {"exact_steps", charges.exact},
            {"exact_abandoned", charges.abandoned},
            {"exact_insisted", charges.forced_exact},
            {"open_pairs_mean", done > 0 ? charges.open_pairs / static_cast<double>(done) : 0.0},
            {"lumen_exits", charges.exits}};
}

/// How often a loop that does nothing but read the clock is held up for longer than the grace of a short budget, by the thread's own clock:
/// the host of a virtual machine takes such times away unseen, and no scheduler inside can keep a deadline through one.
std::string describe_stalls(double seconds) {
    const std::int64_t end = monotonic_ns() + static_cast<std::int64_t>(1e9 * seconds);
    std::uint64_t stalls = 0;
    double worst_ms = 0.0;
    for (std::int64_t last = thread_cpu_ns(), now = last; monotonic_ns() < end; last = now) {
        now = thread_cpu_ns();
        const double held_up_ms = static_cast<double>(now - last) * 1e-6;
        stalls += held_up_ms > kGraceMs;
        worst_ms = std::max(worst_ms, held_up_ms);
    }
    return fmt::format("stalls of this machine: a loop that only reads the clock was held up for more than {} ms {:.0f} times a second "
                       "(worst {:.2f} ms), in time that counts as its own; a short deadline that meets one is missed",
                       kGraceMs, static_cast<double>(stalls) / seconds, worst_ms);
}

} // namespace

Result<BenchTable> bench_deadline(const BenchOptions& options) {
    std::vector<std::filesystem::path> files{"assets/scenes/hepatic.json"};
    if (!options.quick) files.insert(files.end(), {"assets/scenes/two_devices.json", "assets/scenes/guidewire.json", "assets/scenes/coil.json"});
    if (!options.scene.empty()) files = {options.scene};
    BenchTable table;
    for (const std::filesystem::path& file : files) {
        const auto ready = prepare_for_bench(file, options, table);
        if (!ready.ok()) return ready.error();
        const SceneModel& model = ready->prepared.model;
        const std::uint64_t steps = options.quick ? kFirstSteps : std::min(file == files.front() ? model.step_count : kMeetingSteps, model.step_count);
        for (const double budget_ms : kBudgetsMs) {
            options.progress(fmt::format("{}: {} steps under {} ms", ready->scene.name, steps, budget_ms));
            table.rows.push_back(run_under(ready->scene.name, model, budget_ms, steps));
        }
    }
    table.notes.push_back(fmt::format("kept: charged <= budget + the larger of {} ms and {} % of it", kGraceMs, 100.0 * kGraceShare));
    table.notes.push_back(
        "own time: without what the operating system gave to others while the step was being charged (wall clock less the "
        "thread's own); where it fits: own time, without the steps of exact_insisted");
    table.notes.push_back(describe_stalls(options.quick ? 0.1 : 5.0));
    table.notes.push_back("exact_insisted: steps that went over on purpose, because the instrument would have left the lumen");
    return table;
}

} // namespace trocar::engine
