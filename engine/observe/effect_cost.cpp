#include "engine/observe/effect_cost.hpp"

#include "engine/step/simulator.hpp"
#include "engine/time/clock.hpp"

#include <algorithm>
#include <memory>

namespace seldinger::engine {

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
    [[nodiscard]] double median() {
        if (step_ms.empty()) return 0.0;
        std::sort(step_ms.begin(), step_ms.end());
        return step_ms[step_ms.size() / 2];
    }
};

} // namespace

std::vector<EffectCost> measure_effects(const SceneModel& model, std::uint64_t steps,
                                        const std::function<void(const std::string&)>& progress) {
    std::vector<EffectCost> costs;
    for (std::size_t k = 0; k < kEffectCount; ++k) {
        const auto effect = static_cast<Effect>(k);
        if (!has_effect(model, effect)) continue;
        if (progress) progress("without " + std::string(effect_name(effect)));
        const SceneModel less = without_effect(model, effect);
        TimedRun with(model), without(less);
        for (std::uint64_t step = 0; step < steps; ++step) {
            with.step(step, steps);
            without.step(step, steps);
        }
        costs.push_back({effect, with.median(), without.median(), with.counts.of(effect), without.counts.of(effect)});
    }
    return costs;
}

} // namespace seldinger::engine
