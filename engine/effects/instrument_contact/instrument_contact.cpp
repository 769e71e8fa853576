// Instruments of one lumen against one another: part of the solve of their rods, fem/rod/rods_together.hpp and fem/rod/rod_meetings.hpp.
#include "engine/effects/describe.hpp"
#include "engine/effects/registry.hpp"
#include "engine/prepare/effect_preparation.hpp"
#include "engine/prepare/prepare_scene.hpp"
#include "fem/rod/rods_together.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace trocar::engine::effects {

namespace {

std::size_t count_meeting(const SceneModel& model) {
    return static_cast<std::size_t>(std::count_if(model.instruments.begin(), model.instruments.end(), meets_instruments));
}

/// Two devices that enter within one another could never be parted.
Result<void> check_ports(const EffectPreparation& preparation) {
    const SceneModel& model = preparation.prepared.model;
    std::size_t joined = 0;
    for (std::size_t i = 0; i < model.instruments.size(); ++i) joined += may_be_joined(model, i);
    if (joined > fem::kMostTogether)
        return scene_error(preparation.scene, "instruments",
                           fmt::format("{} instruments have play in a bore or meet one another; expected at most {}", joined, fem::kMostTogether));
    if (!model.effects.instrument_contact) return {};
    for (std::size_t a = 0; a < model.instruments.size(); ++a)
        for (std::size_t b = a + 1; b < model.instruments.size(); ++b) {
            const InstrumentModel &one = model.instruments[a], &other = model.instruments[b];
            if (!meets_instruments(one) || !meets_instruments(other) || one.lumen != other.lumen || other.inside == a) continue;
            const double apart = std::sqrt((one.port.position - other.port.position).squaredNorm());
            const double radii = one.rod.design.radius + other.rod.design.radius;
            if (apart >= radii || std::find(other.waits_for.begin(), other.waits_for.end(), a) != other.waits_for.end()) continue;
            return scene_error(preparation.scene, "instruments." + other.name + ".entry",
                               fmt::format("with the effect \"instrument_contact\", {} enters {:.4g} mm from where {} does; expected at least {:.4g} mm, the "
                                           "sum of their radii: side by side; or {} \"detachable\", and {} comes out after it",
                                           other.name, 1e3 * apart, one.name, 1e3 * radii, one.name, other.name));
        }
    return {};
}

} // namespace

const EffectDescriptor instrument_contact{
    .name = "instrument_contact",
    .label = "instruments against one another",
    .doc = "Instruments of one lumen against one another, side by side and crossing; needs coarse_contact.",
    .acts_on = [](const SceneModel& model) { return model.effects.instrument_contact && count_meeting(model) > 1; },
    .remove = [](SceneModel& model) { model.effects.instrument_contact = false; },
    .explain = [](const Scene& scene, const SceneModel& model) -> EffectLine {
        const std::size_t count = count_meeting(model);
        if (count < 2) return {false, "fewer than two instruments are rods of their own"};
        if (!scene.effects.coarse_contact) return {false, "needs the effect coarse_contact"};
        const bool on = scene.effects.instrument_contact;
        return {on, listed(on, fmt::format("{} instruments against one another, solved together where they are near: continuous", count))};
    },
    .floor = [](const SceneModel&) -> std::string {
        return "all of it: pairs of segments near one another and the solve of their rods together, charged";
    },
    .prepare = check_ports,
};

} // namespace trocar::engine::effects
