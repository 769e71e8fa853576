#include "engine/cli/commands.hpp"
#include "engine/cli/progress.hpp"
#include "engine/observe/observer.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <csignal>
#include <cstdio>
#include <memory>

namespace seldinger::engine {

namespace {

struct RunOptions {
    std::filesystem::path scene;
    std::filesystem::path out;     // empty: out/<scene name>
    std::int64_t steps = -1;       // < 0: as the scene says
    std::string budget;            // empty: as the scene says
    std::filesystem::path path;    // CSV that replaces the first instrument's script
    bool record = false, force = false, fail_on_overrun = false, pictures = true, quiet = false;
};

volatile std::sig_atomic_t interrupt_requested = 0;

void request_interrupt(int) { interrupt_requested = 1; }

/// What the command line says overrides what the scene says.
Result<void> apply_overrides(const RunOptions& options, Scene& scene) {
    if (!options.budget.empty()) {
        const Result<BudgetSpec> budget = parse_budget(options.budget);
        if (!budget.ok()) {
            Error error = budget.error();
            error.key = "--budget";
            return error;
        }
        scene.budget.limits = budget->limits;
    }
    if (!options.path.empty()) {
        if (scene.instruments.empty())
            return Error{ErrorCode::BadUsage, "the scene has no instrument that could follow a path", {}, 0, 0, "--path"};
        auto path = read_instrument_path(scene, scene.instruments.front(), options.path);
        if (!path.ok()) return path.error();
        scene.instruments.front().path = std::move(*path);
        scene.instruments.front().path_file = options.path;
        scene.instruments.front().follow.reset();
    }
    return {};
}

void print_summary(const RunSummary& summary, const PreparedScene& prepared, const std::filesystem::path& out) {
    fmt::print("{} steps in {:.3g} s, real-time factor {:.3g}, step p50/p95/p99/max {:.3g}/{:.3g}/{:.3g}/{:.3g} ms, "
               "budget kept in {:.2f} %\n", summary.steps, summary.wall_s, summary.realtime_factor, summary.step_ms.p50,
               summary.step_ms.p95, summary.step_ms.p99, summary.step_ms.max, 100.0 * summary.budget_kept);
    if (!prepared.model.instruments.empty())
        fmt::print("lumen exits {}, exact contacts in {} of {} steps, {} held back, {} unresolved, {} assumed\n",
                   summary.lumen_exits, summary.exact_steps, summary.steps, summary.held_back_steps, summary.unresolved,
                   summary.assumed);
    if (summary.target_distance_m >= 0.0) fmt::print("tip to target {:.2f} mm\n", 1e3 * summary.target_distance_m);
    fmt::print("state {}   report {}\n", summary.state_hash, (out / "report.html").string());
}

/// Steps until done, stopped, or interrupted. Returns an error only when the output cannot be written.
Result<bool> take_steps(Simulator& simulator, RunObserver& observer, std::uint64_t steps, ProgressLine& progress) {
    for (std::uint64_t k = 0; k < steps; ++k) {
        if (interrupt_requested) return true;
        const StepReport& report = simulator.step();
        const Result<void> observed = observer.after_step(simulator, report);
        if (!observed.ok()) return observed.error();
        progress.show_step(k + 1, steps, report);
        if (!report.finite) break;
    }
    return false;
}

int simulate(const RunOptions& options, const Scene& scene, const PreparedScene& prepared, ProgressLine& progress) {
    ObserveOptions observe;
    observe.out = options.out.empty() ? std::filesystem::path("out") / scene.name : options.out;
    observe.force = options.force;
    observe.record = options.record;
    observe.pictures = options.pictures;
    observe.steps = options.steps >= 0 ? static_cast<std::uint64_t>(options.steps) : prepared.model.step_count;
    auto observer = RunObserver::open(scene, prepared, observe);
    if (!observer.ok()) return report_error(observer.error());

    std::signal(SIGINT, request_interrupt);
    std::signal(SIGTERM, request_interrupt);
    Simulator simulator(prepared.model);
    const StopWatch watch;
    const Result<bool> interrupted = take_steps(simulator, **observer, observe.steps, progress);
    progress.clear();
    if (!interrupted.ok()) return report_error(interrupted.error());
    const auto summary = (*observer)->finish(simulator, 1e-3 * watch.elapsed_ms(), *interrupted);
    if (!summary.ok()) return report_error(summary.error());
    for (const std::string& notice : (*observer)->notices()) fmt::print(stderr, "notice: {}\n", notice);
    print_summary(*summary, prepared, observe.out);
    if (!summary->finite) {
        fmt::print(stderr, "error: stopped: {}; the last good state is saved\n", summary->failure);
        return kExitNotFinite;
    }
    if (*interrupted) return kExitInterrupted;
    return options.fail_on_overrun && summary->overruns > 0 ? kExitOverrun : kExitFine;
}

int run(const RunOptions& options) {
    Result<Scene> scene = read_scene(options.scene);
    if (!scene.ok()) return report_error(scene.error());
    const Result<void> overridden = apply_overrides(options, *scene);
    if (!overridden.ok()) return report_error(overridden.error());
    ProgressLine progress(!options.quiet);
    const auto prepared = prepare_scene(*scene, [&](const std::string& what) { progress.show("preparing " + what); });
    progress.clear();
    if (!prepared.ok()) return report_error(prepared.error());
    return simulate(options, *scene, *prepared, progress);
}

} // namespace

Command add_run_command(CLI::App& app) {
    const auto run_options = std::make_shared<RunOptions>();
    RunOptions& options = *run_options;
    CLI::App* command = app.add_subcommand("run", "Simulate a scene without a display and report what was done");
    command->add_option("scene", options.scene, "scene file (JSON)")->required();
    command->add_option("--out", options.out, "output folder; out/<scene name> where none is given");
    command->add_option("-n,--steps", options.steps, "steps to take instead of the scene's duration")
        ->check(CLI::Range(std::int64_t{0}, std::int64_t{1'000'000'000}));
    command->add_option("--budget", options.budget, "per step: a time (1ms, 250us), work:TESTS, or exact");
    command->add_option("--path", options.path, "CSV t,insertion,rotation in the scene's units, instead of the scene's script");
    command->add_flag("--record", options.record, "write states for ParaView (PVD, VTP)");
    command->add_flag("--force", options.force, "write into an output folder that is not empty");
    command->add_flag("--fail-on-overrun", options.fail_on_overrun, "exit 4 when a step missed its budget");
    command->add_flag("!--no-pictures", options.pictures, "take no pictures");
    command->add_flag("--quiet", options.quiet, "no progress line");
    return {command, [run_options] { return run(*run_options); }};
}

} // namespace seldinger::engine
