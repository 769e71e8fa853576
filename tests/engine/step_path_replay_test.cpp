// A run's own drive commands, written in a scene's units and read again, are the same run to the bit.
#include "step_fixture.hpp"

#include <random>

namespace trocar::engine {
namespace {

TEST(PathReplay, OfAnyDriveInAnyUnitsIsTheSameRunToTheBit) {
    const PreparedScene prepared = test::prepare(test::bent_tube_scene({.budget = "work:3000"}));
    for (const double unit : {1.0, 1e-2, 1e-3, 1e-6, 0.0254})
        for (std::uint64_t seed = 1; seed <= 2; ++seed) {
            SCOPED_TRACE(fmt::format("a unit of {} m, seed {}", unit, seed));
            std::mt19937_64 rng(seed);
            std::uniform_real_distribution<double> speed(-0.01, 0.035), turn(-3.0, 3.0); // m/s, rad/s
            SceneModel replayed = prepared.model;
            Simulator simulator(prepared.model);
            const auto row = [&] {
                const State& state = simulator.raw_state();
                const fem::RodState& rod = state.instruments[0].rod;
                const double angle = unit < 1.0 ? 0.017453292519943295 : 1.0; // degrees, too
                return DriveRow{state.time / unit * unit, rod.insertion / unit * unit, rod.rotation / angle * angle};
            };
            std::vector<DriveRow> path{row()};
            DriveCommand wanted{path[0].insertion, path[0].rotation};
            for (int step = 0; step < 150; ++step) {
                wanted.insertion += 0.01 * speed(rng);
                wanted.rotation += 0.01 * turn(rng);
                Inputs inputs;
                inputs.drive.assign(1, wanted);
                ASSERT_TRUE(simulator.step(inputs).ok());
                path.push_back(row());
            }
            replayed.instruments[0].path = path;
            Simulator again(replayed);
            for (int step = 0; step < 150; ++step) ASSERT_TRUE(again.step().finite);
            EXPECT_EQ(hash_state(again.state()), hash_state(simulator.state()));
        }
}

} // namespace
} // namespace trocar::engine
