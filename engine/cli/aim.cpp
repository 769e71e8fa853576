#include "engine/cli/aim.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

namespace trocar::engine {

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
    SceneInstrument& instrument = scene.instruments.front();
    if (!instrument.follow) instrument.follow.emplace();
    instrument.follow->target = index;
    double& speed = instrument.follow->settings.speed;
    speed = std::min(speed, instrument.limits.speed);
    return {};
}

} // namespace trocar::engine
