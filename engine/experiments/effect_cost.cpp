#include "engine/experiments/effect_cost.hpp"

#include "engine/effects/call.hpp"
#include "engine/effects/registry.hpp"
#include "engine/state/state.hpp"
#include "engine/step/simulator.hpp"
#include "engine/time/clock.hpp"

#include <algorithm>
#include <cmath>
#include <memory>

namespace trocar::engine {

namespace {

/// Steps at the start of a run that find memory and learn rates.
constexpr std::uint64_t kFirstSteps = 5;

struct TimedRun {
    std::unique_ptr<Simulator> simulator;
    std::vector<double> step_ms;
    EffectCounts counts;

    explicit TimedRun(const SceneModel& model) : simulator(std::make_unique<Simulator>(model)) {}
    void step(std::uint64_t k, std::uint64_t steps) {
        const std::int64_t began = thread_cpu_ns();
        const StepReport& report = simulator->step();
        const double ms = 1e-6 * static_cast<double>(thread_cpu_ns() - began) - report.ms.observe;
        counts += report.effects;
        if (k >= kFirstSteps || steps <= 2 * kFirstSteps) step_ms.push_back(ms);
    }
    [[nodiscard]] double median() const {
        std::vector<double> sorted = step_ms;
        return quantile(sorted, 0.5);
    }
    /// Sorts.
    static double quantile(std::vector<double>& values, double share) {
        if (values.empty()) return 0.0;
        std::sort(values.begin(), values.end());
        return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1) + 0.5)];
    }
};

/// ms; twice the standard error of the median difference. Robust: a step that something else interrupted is one step.
/// source   of normal values the quartiles lie 1.349 deviations apart, and a median's error is 1.253 of a mean's
double find_noise(const TimedRun& with, const TimedRun& without) {
    std::vector<double> differences;
    for (std::size_t k = 0; k < with.step_ms.size(); ++k) differences.push_back(with.step_ms[k] - without.step_ms[k]);
    if (differences.size() < 2) return 0.0;
    const double spread = TimedRun::quantile(differences, 0.75) - TimedRun::quantile(differences, 0.25);
    return 2.0 * 1.253 * spread / 1.349 / std::sqrt(static_cast<double>(differences.size()));
}

} // namespace

std::vector<EffectCost> measure_effects(const SceneModel& model, std::uint64_t steps,
                                        const std::function<void(const std::string&)>& progress) {
    std::vector<EffectCost> costs;
    for (const EffectDescriptor* effect : registered_effects()) {
        if (!has_effect(model, *effect)) continue;
        if (progress) progress("without " + std::string(effect->name));
        const SceneModel less = without_effect(model, *effect);
        TimedRun with(model), without(less);
        for (std::uint64_t step = 0; step < steps; ++step) {
            with.step(step, steps);
            without.step(step, steps);
        }
        costs.push_back(
            {effect, with.median(), without.median(), find_noise(with, without), with.counts.of(*effect), without.counts.of(*effect)});
    }
    return costs;
}

} // namespace trocar::engine
