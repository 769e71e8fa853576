#include "engine/experiments/plan_scene.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <vector>

namespace trocar::engine {

namespace {

/// Multiple of the way's time at drive speed that a trial may take: forks cost several attempts.
constexpr double kPatience = 6.0;
/// s that every trial may take.
constexpr double kShortestTrial = 10.0;

} // namespace

Result<void> aim_first_instrument(Scene& scene, const std::string& target) {
    if (scene.instruments.empty())
        return Error{ErrorCode::BadUsage, "the scene has no instrument to plan a way for", scene.file.string(), 0, 0, "instruments"};
    const Index index = find_target(scene, target);
    if (index == kNoIndex) {
        std::vector<std::string> known;
        for (const SceneTarget& each : scene.targets) known.push_back(each.name);
        return Error{ErrorCode::BadUsage,
                     known.empty() ? fmt::format("no target '{}': the scene names none", target)
                                   : fmt::format("no target '{}'; known: {}", target, fmt::join(known, ", ")),
                     {},
                     0,
                     0,
                     "--to"};
    }
    SceneInstrument& instrument = scene.instruments[kLeadInstrument];
    if (!instrument.follow) instrument.follow.emplace();
    instrument.follow->target = index;
    double& speed = instrument.follow->settings.speed;
    speed = std::min(speed, instrument.limits.speed);
    return {};
}

Result<void> aim_to_plan(Scene& scene, const std::string& target) {
    if (auto aimed = aim_first_instrument(scene, target); !aimed.ok()) return aimed;
    scene.instruments[kLeadInstrument].path.clear();
    if (scene.budget.limits.mode == BudgetMode::Wall) scene.budget.limits = {};
    return {};
}

Result<void> check_bends(const Scene& scene, const RouteReport& route, const std::string& target) {
    const SceneInstrument& instrument = scene.instruments[kLeadInstrument];
    if (!(route.sharpest_curvature * instrument.min_bend_radius > 1.0)) return {};
    return scene_error(scene, "instruments." + instrument.name + ".min_bend_radius",
                       fmt::format("no way from the entry to {}: {:.3g} mm along it the lumen bends to a radius of {:.3g} mm, "
                                   "the instrument bends to {:.3g} mm",
                                   target, 1e3 * route.sharpest_curvature_at, 1e3 / route.sharpest_curvature,
                                   1e3 * instrument.min_bend_radius));
}

double usual_trial_time(const RouteReport& route, const InstrumentModel& instrument) noexcept {
    return std::max(kShortestTrial, kPatience * route.length / instrument.follow.speed);
}

} // namespace trocar::engine
