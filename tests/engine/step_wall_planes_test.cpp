// A rod against a wall of facets: what its planes say holds whatever the facets are.
#include "step_fixture.hpp"

#include <random>

namespace trocar::engine {
namespace {

/// A J in a straight tube of so many sides, driven at full speed for half a second and held from then on.
std::string prism_scene(int sides, double angle, double turn, const char* effects) {
    return fmt::format(R"({{
    "name": "prism", "units": {{"length": "mm", "pressure": "kPa"}}, "time": {{"step": 0.01, "duration": 10}}, "budget": "exact",
    "bodies": {{"tube": {{"kind": "static", "hollow": true, "surface": {{"shape": "tube", "axis": [[0, 0, 0, 3], [0, 0, 50, 3], [0, 0, 120, 3]],
        "sides": {}}}}}}},
    "instruments": {{"wire": {{"length": 220, "radius": 0.5, "young_modulus": 60000, "segment": 2.5, "skin_triangles": 1500,
        "tip": {{"shape": "J", "length": 12, "angle": {:.6f}}}, "lumen": "tube",
        "entry": {{"position": [0, 0, 10], "direction": [0, 0, 1]}}, "path": [[0, 30, 0], [0.5, 47.5, {:.6f}], [10, 47.5, {:.6f}]]}}}},
    "effects": [{}]
}})",
                       sides, angle, turn, turn, effects);
}

/// Facets that turn towards one another, seen from within: a tip in the valley between two rests on both, and does not go to and fro.
TEST(WallPlanes, ARodComesToRestBetweenFacetsOfAnyNumber) {
    std::mt19937_64 rng(28);
    std::uniform_int_distribution<int> sides(5, 40);
    std::uniform_real_distribution<double> angle(0.4, 1.2), turn(-1.5, 1.5);
    std::size_t pressing = 0;
    for (int round = 0; round < 8; ++round) {
        const int count = sides(rng);
        const double bent = angle(rng), turned = turn(rng);
        const PreparedScene prepared =
            test::prepare(prism_scene(count, bent, turned, R"("coarse_contact", "exact_contact", "friction")"));
        Simulator simulator(prepared.model);
        for (int step = 0; step < 200; ++step) ASSERT_TRUE(simulator.step().finite);
        std::vector<Vec3> before = simulator.state().instruments[0].rod.position;
        for (int step = 0; step < 20; ++step) {
            ASSERT_TRUE(simulator.step().finite);
            const InstrumentState& now = simulator.state().instruments[0];
            double farthest = 0.0;
            for (std::size_t n = 0; n < before.size(); ++n) farthest = std::max(farthest, (now.rod.position[n] - before[n]).norm());
            EXPECT_LT(farthest, 1e-8) << "m in a step; " << count << " sides, J of " << bent << " rad turned by " << turned << ", step " << step;
            before = now.rod.position;
            for (const fem::RodPlane& plane : now.planes) pressing += plane.force > 0.0;
        }
    }
    EXPECT_GT(pressing, 100u) << "tips lie on the wall";
}

/// Triangles ahead of a place in a flat facet say nothing that the facet does not: the wall would push back along the tube.
TEST(WallPlanes, OfAPrismNeverLookAlongIt) {
    std::mt19937_64 rng(29);
    std::uniform_int_distribution<int> sides(5, 40);
    std::uniform_real_distribution<double> angle(0.4, 1.2), turn(-1.5, 1.5);
    std::size_t seen = 0;
    for (int round = 0; round < 8; ++round) {
        const int count = sides(rng);
        const PreparedScene prepared =
            test::prepare(prism_scene(count, angle(rng), turn(rng), R"("coarse_contact", "exact_contact", "friction")"));
        Simulator simulator(prepared.model);
        for (int step = 0; step < 60; ++step) {
            ASSERT_TRUE(simulator.step().finite);
            for (const fem::RodPlane& plane : simulator.state().instruments[0].planes) {
                EXPECT_LT(std::abs(plane.normal.z()), 1e-9) << count << " sides, step " << step;
                ++seen;
            }
        }
    }
    EXPECT_GT(seen, 1000u);
}

} // namespace
} // namespace trocar::engine
