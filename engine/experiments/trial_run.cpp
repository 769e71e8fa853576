#include "engine/experiments/trial_run.hpp"

#include "engine/experiments/laid_out.hpp"
#include "engine/step/simulator.hpp"
#include "engine/time/clock.hpp"

#include <algorithm>

#include <sys/resource.h>

namespace trocar::engine {
namespace {

/// s until the slowest of the instruments that follow a route has gone along it, at best.
double arrival_time(const SceneModel& model) {
    double time = 0.0;
    for (const InstrumentModel& instrument : model.instruments)
        if (instrument.route) time = std::max(time, (instrument.route->length.back() - instrument.inserted) / instrument.follow.speed);
    return time;
}

} // namespace

double Trial::middle(std::vector<double>& values) {
    std::sort(values.begin(), values.end());
    return values.empty() ? 0.0 : values[values.size() / 2];
}

Trial try_steps(const SceneModel& model, const std::optional<State>& from, std::uint64_t settling, std::uint64_t steps, double limit_ms) {
    Simulator simulator(model);
    Trial trial;
    if (from)
        if (const Result<void> restored = simulator.restore(*from); !restored) {
            trial.last.failure = restored.error().message;
            return trial;
        }
    const StopWatch watch;
    const auto step = [&] { return (trial.last = simulator.step()).finite; };
    for (std::uint64_t k = 0; k < settling && watch.elapsed_ms() < limit_ms; ++k)
        if (!step()) return trial;
    while (trial.total.size() < steps && (trial.total.size() < kFewestSteps || watch.elapsed_ms() < limit_ms)) {
        if (!step()) return trial;
        trial.total.push_back(trial.last.ms.total);
        trial.collision.push_back(trial.last.ms.descend + trial.last.ms.exact);
    }
    return trial;
}

double mean_step_ms(const SceneModel& model, Trial& first, Trial& late, std::uint64_t steps) {
    const double middle = Trial::middle(first.total), run_s = static_cast<double>(steps) * model.step_s;
    if (late.total.empty()) return middle;
    const double end = Trial::middle(late.total);
    const double arrival_s = arrival_time(model);
    if (run_s > arrival_s) {
        const double share = arrival_s / run_s; // of the run that is spent on the way
        return share * 0.5 * (middle + end) + (1.0 - share) * end;
    }
    return middle + 0.5 * (end - middle) * (arrival_s > 0.0 ? run_s / arrival_s : 1.0); // it ends on the way
}

RunForecast forecast_run(const SceneModel& model, std::uint64_t steps, double limit_ms) {
    RunForecast forecast;
    const std::uint64_t tried = std::min(kTrialSteps, std::max<std::uint64_t>(steps, 1));
    Trial first = try_steps(model, {}, 0, tried, limit_ms), late;
    forecast.failure = first.last.failure;
    if (const std::optional<State> inside = steps > kTrialSteps ? lay_along_routes(model) : std::nullopt)
        late = try_steps(model, inside, kSettlingSteps, tried, limit_ms);
    forecast.step_ms = mean_step_ms(model, first, late, steps);
    forecast.run_s = 1e-3 * forecast.step_ms * static_cast<double>(steps);
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    forecast.memory_mb = static_cast<double>(usage.ru_maxrss) / 1024.0;
    return forecast;
}

} // namespace trocar::engine
