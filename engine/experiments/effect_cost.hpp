// The cost of each effect of a scene: the scene as it is beside the scene without it.
#pragma once

#include "engine/effects/registry.hpp"

#include <functional>
#include <vector>

namespace trocar::engine {

struct EffectCost {
    const EffectDescriptor* effect = nullptr;
    double with_ms = 0.0, without_ms = 0.0; // median of a whole step, processor time of this thread
    double noise_ms = 0.0;                  // of saved_ms: twice its standard error, from the spread of the steps' differences
    std::uint64_t entered = 0;              // times that its code was entered in the run with it
    std::uint64_t entered_without = 0;      // in the run without it: 0
    [[nodiscard]] double saved_ms() const noexcept { return with_ms - without_ms; }
    /// Less than the steps' spread lets one tell, or nothing at all.
    [[nodiscard]] bool is_lost_in_noise() const noexcept { return saved_ms() <= noise_ms; }
};

/// Every effect that the model has, each left out alone. Runs in turns, so that what else the machine does falls on both.
/// steps   of every run; the first ones, in which memory is found, do not count where there are more than a few
/// cost    as many times the scene's as it has effects, and again
[[nodiscard]] std::vector<EffectCost> measure_effects(const SceneModel& model, std::uint64_t steps,
                                                      const std::function<void(const std::string&)>& progress = {});

} // namespace trocar::engine
