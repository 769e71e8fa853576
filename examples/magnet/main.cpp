// Steps a scene twice, as it is and with a magnet beside it, and prints how far apart the tips end.
#include "magnet.hpp"

#include <cstdio>
#include <cstdlib>

namespace sim = trocar::engine;

namespace {

/// The tip after so many steps, or nothing where the scene is refused.
std::optional<trocar::Vec3> tip_after(const sim::Scene& scene, int steps) {
    const auto prepared = sim::prepare_scene(scene);
    if (!prepared.ok()) return std::fprintf(stderr, "%s\n", prepared.error().to_string().c_str()), std::nullopt;
    sim::Simulator simulator(*prepared);
    for (int k = 0; k < steps; ++k) simulator.step();
    if (!simulator.report().finite) return std::fprintf(stderr, "%s\n", simulator.report().failure.c_str()), std::nullopt;
    return simulator.report().tip;
}

} // namespace

int main(int argc, char** argv) {
    if (argc < 2) return std::fprintf(stderr, "usage: magnet SCENE [STEPS]\n"), 2;
    if (const auto added = sim::add_effect(magnet); !added.ok()) return std::fprintf(stderr, "%s\n", added.error().to_string().c_str()), 2;
    auto scene = sim::read_scene(argv[1]);
    if (!scene.ok()) return std::fprintf(stderr, "%s\n", scene.error().to_string().c_str()), 2;
    const int steps = argc > 2 ? std::atoi(argv[2]) : 100;

    const auto plain = tip_after(*scene, steps);
    scene->effects.added = {{&magnet, {0.05, 0.1, 0.0, 0.1}}}; // as "magnet": {"force": 0.05, "place": [0.1, 0, 0.1]} in SI
    const auto pulled = tip_after(*scene, steps);
    if (!plain || !pulled) return 3;
    const double way = 1e3 * std::sqrt((*pulled - *plain).squaredNorm());
    std::printf("the magnet drew the tip %.3f mm aside\n", way);
    return way > 0.0 ? 0 : 1;
}
