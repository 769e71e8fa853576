#include "engine/scene/section.hpp"

#include <algorithm>

namespace trocar::engine {

fem::RodDesign solid_section(const SceneInstrument& instrument) {
    fem::RodDesign design = instrument.design;
    if (instrument.inner_radius == 0.0 && instrument.layers.empty()) return design;
    std::vector<TubeLayer> layers = instrument.layers;
    if (layers.empty()) layers.push_back({design.radius, design.young_modulus, design.density});
    double inside = instrument.inner_radius / design.radius; // of the radius
    double bend = 0.0, stretch = 0.0, mass = 0.0, turn = 0.0;
    for (const TubeLayer& layer : layers) {
        const double outside = std::min(layer.outer_radius / design.radius, 1.0);
        const double inner_sq = inside * inside, outer_sq = outside * outside;
        const double area = outer_sq - inner_sq, second = outer_sq * outer_sq - inner_sq * inner_sq;
        stretch += layer.young_modulus * area, bend += layer.young_modulus * second;
        mass += layer.density * area, turn += layer.density * second;
        inside = outside;
    }
    design.young_modulus = bend, design.density = mass;
    design.stretch_factor = stretch / bend, design.turn_factor = turn / mass;
    return design;
}

Bending find_bending(const fem::RodModel& rod) noexcept {
    const double cubed = rod.segment * rod.segment * rod.segment;
    return {rod.bend_stiffness[1] * cubed, rod.bend_stiffness[rod.node_count() - 2] * cubed};
}

} // namespace trocar::engine
