#include "engine/experiments/sweep/forecast.hpp"

#include "engine/experiments/trial_run.hpp"
#include "engine/scene/override.hpp"
#include "engine/time/clock.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstdlib>

namespace trocar::engine {
namespace {

constexpr double kTryFor = 1e3;   // ms
constexpr double kStart_s = 0.05; // of a process, its outputs and its row
/// A row of `cost` is its own run and one along the exact run; without --budgets there are five.
constexpr double kCostRuns = 11.0;
constexpr std::uint64_t kCostSteps = 300; // without -n
/// `plan` drives, and then replays the path.
constexpr double kPlanRuns = 2.0;

/// An episode has a time limit of its own, from the way's length: never less than this, and a policy may arrive earlier.
constexpr double kEpisode_s = 10.0;

std::uint64_t count_steps(const SweepPlan& plan, const SceneModel& model) {
    if (plan.command == SweepCommand::Episode) {
        double limit = kEpisode_s;
        for (std::size_t i = 0; i + 1 < plan.options.size(); ++i)
            if (plan.options[i] == "--time") limit = std::strtod(plan.options[i + 1].c_str(), nullptr);
        return static_cast<std::uint64_t>(std::clamp(limit / model.step_s, 1.0, 1e9));
    }
    std::uint64_t steps = plan.command == SweepCommand::Cost ? std::min(model.step_count, kCostSteps) : model.step_count;
    for (std::size_t i = 0; i + 1 < plan.options.size(); ++i)
        if (plan.options[i] == "-n" || plan.options[i] == "--steps")
            std::from_chars(plan.options[i + 1].data(), plan.options[i + 1].data() + plan.options[i + 1].size(), steps);
    return steps;
}

double count_runs(const SweepPlan& plan) {
    if (plan.command == SweepCommand::Run || plan.command == SweepCommand::Episode) return 1.0;
    if (plan.command == SweepCommand::Plan) return kPlanRuns;
    for (std::size_t i = 0; i + 1 < plan.options.size(); ++i)
        if (plan.options[i] == "--budgets")
            return 1.0 + 2.0 * static_cast<double>(1 + std::count(plan.options[i + 1].begin(), plan.options[i + 1].end(), ','));
    return kCostRuns;
}

} // namespace

Result<Scene> scene_of(const SweepPlan& plan, const PlannedRun& run) {
    std::vector<SceneOverride> overrides;
    for (const auto& [pointer, value] : run.settings) {
        if (is_option(pointer)) continue;
        auto override = parse_override(pointer + "=" + value);
        if (!override) return override.error();
        overrides.push_back(std::move(*override));
    }
    return read_scene(plan.scenes[run.scene].file, overrides);
}

SweepForecast forecast_sweep(const SweepPlan& plan, const Progress& progress) {
    SweepForecast forecast;
    if (plan.command == SweepCommand::Verify) return forecast; // its list names scenes of its own
    const std::uint64_t per_scene = plan.run_count() / plan.scenes.size();
    double sum_s = 0.0;
    for (std::size_t i = 0; i < plan.scenes.size(); ++i)
        for (const std::uint64_t offset : {std::uint64_t{0}, per_scene - plan.repeat}) {
            if (offset == 0 && per_scene > plan.repeat && plan.scenes.size() > 1) continue; // of many scenes the last run alone
            const PlannedRun run = plan.run(i * per_scene + offset);
            const auto failed = [&](const Error& error) {
                if (forecast.failure.empty()) forecast.failure = fmt::format("run {}: {}", run.number, error.to_string());
            };
            const auto scene = scene_of(plan, run);
            if (!scene) {
                failed(scene.error());
                continue;
            }
            const StopWatch watch;
            const auto prepared = make_prepared_scene(*scene, [&](const std::string& what) { progress(plan.scene_names[i] + ": preparing " + what); });
            if (!prepared) {
                failed(prepared.error());
                continue;
            }
            const double prepare_s = 1e-3 * watch.elapsed_ms();
            progress(plan.scene_names[i] + ": trying some steps");
            const RunForecast one = forecast_run(prepared->model, count_steps(plan, prepared->model), kTryFor);
            const double run_s = kStart_s + prepare_s + count_runs(plan) * one.run_s;
            sum_s += run_s;
            forecast.longest_s = std::max(forecast.longest_s, run_s);
            forecast.memory_mb = std::max(forecast.memory_mb, one.memory_mb);
            ++forecast.tried;
            if (per_scene == plan.repeat) break; // the first is the last
        }
    if (forecast.tried > 0) forecast.run_s = sum_s / static_cast<double>(forecast.tried);
    return forecast;
}

Result<void> prepare_scenes(const SweepPlan& plan, const Progress& progress) {
    if (plan.command == SweepCommand::Verify) return {};
    const std::uint64_t per_scene = plan.run_count() / plan.scenes.size();
    for (std::size_t i = 0; i < plan.scenes.size(); ++i) {
        const auto scene = scene_of(plan, plan.run(i * per_scene));
        if (!scene) return scene.error();
        if (const auto prepared = make_prepared_scene(*scene, progress); !prepared) return prepared.error();
    }
    return {};
}

} // namespace trocar::engine
