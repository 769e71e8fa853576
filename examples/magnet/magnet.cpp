#include "magnet.hpp"

#include <cmath>

namespace sim = trocar::engine;
using trocar::Vec3;

namespace {

/// Settings come in the order of the keys below: force, then the place's three coordinates; in SI whatever the scene's units.
void pull_the_tip(const sim::EffectStep& step, std::size_t instrument, sim::State& state, sim::RodLoads& loads) {
    const std::span<const Vec3> rod = sim::view_instrument(step.model, state, instrument).rod;
    const Vec3 way = Vec3(step.settings[1], step.settings[2], step.settings[3]) - rod.back();
    const double distance = std::sqrt(way.squaredNorm());
    if (!(distance > 0.0)) return;
    loads.force.resize(rod.size(), Vec3::Zero()); // other effects may have sized it
    loads.force.back() += step.settings[0] / distance * way;
    step.counts.note(magnet);
}

} // namespace

const sim::EffectDescriptor magnet{
    .name = "magnet",
    .label = "magnet",
    .doc = "A magnet pulls at the tips of instruments.",
    .settings = {sim::number_field("force", sim::Dimension::Force, sim::between(0.0, 1.0), "With which it pulls.").by_default(0.01),
                 sim::vector_field("place", sim::Dimension::Length, sim::coordinate(), "Of the magnet.").by_default(Vec3(0, 0, 0))},
    .load_rod = pull_the_tip,
};
