// Two devices side by side in one lumen: what the effect instrument_contact promises, whatever the budget and the step's length.
#include "engine/effects/registry.hpp"
#include "meeting_fixture.hpp"

#include <random>

namespace trocar::engine {
namespace {

struct TwoDevices {
    double one = 0.8, two = 0.6, friction = 0.1, step = 0.01, speed = 30.0, far = 90.0, apart = 2.0; // mm, s, mm/s
    std::string budget = "exact", effects = R"("coarse_contact", "exact_contact", "friction", "instrument_contact")";
};

std::string devices_text(const TwoDevices& c) {
    const double time = c.far / c.speed;
    const auto device = [&](const char* name, double radius, double x, double insertion) {
        return fmt::format(R"("{}": {{"length": 120, "radius": {}, "young_modulus": 80, "segment": 2.5, "skin_triangles": 2000, "lumen": "tube", "friction": {},
        "inserted": 5, "entry": {{"position": [{}, 0.2, 4], "direction": [0, 0, 1]}}, "limits": {{"speed": 4000}}, "path": [[0, 5, 0], [{}, {}, 2]]}})",
                           name, radius, c.friction, x, time, insertion);
    };
    return fmt::format(R"({{
    "name": "two", "units": {{"length": "mm", "pressure": "MPa"}}, "time": {{"step": {}, "duration": {}}}, "budget": "{}",
    "bodies": {{"tube": {{"kind": "static", "hollow": true, "surface": {{"shape": "vessels", "triangles": 4000, "blend": 1,
        "branches": [[[0, 0, 0, 3], [0, 0, 40, 3], [10, 0, 70, 3], [30, 0, 90, 3], [60, 0, 100, 3]]]}}}}}},
    "instruments": {{{}, {}}}, "effects": [{}]
}})",
                       c.step, time, c.budget, device("one", c.one, -0.5 * c.apart, 5.0 + c.far), device("two", c.two, 0.5 * c.apart, 5.0 + 0.6 * c.far), c.effects);
}

TEST(RodsMeetScene, NoDevicePassesThroughTheOtherAtAnyBudgetAndStep) {
    std::mt19937_64 rng(31);
    const auto between = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(rng); };
    std::size_t contacts = 0;
    for (const char* budget : {"exact", "work:0", "work:3000", "exact"}) {
        TwoDevices c;
        c.budget = budget;
        c.one = between(0.5, 0.9), c.two = between(0.4, 0.9), c.friction = between(0.0, 0.3), c.speed = budget[0] == 'w' ? 60.0 : 30.0;
        c.step = between(0.0, 1.0) < 0.5 ? 0.01 : 0.004;
        const PreparedScene prepared = test::prepare(devices_text(c));
        ASSERT_EQ(prepared.model.instruments.size(), 2u);
        Simulator simulator(prepared.model);
        double nearest = 10.0;
        std::size_t held = 0, steps = 0, exits = 0;
        while (simulator.state().time < c.far / c.speed - 1e-9) {
            const StepReport& report = simulator.step();
            ASSERT_TRUE(report.finite) << report.failure;
            nearest = std::min(nearest, test::nearest_of(prepared.model, simulator.state()));
            contacts += report.instrument_contacts, held += report.instrument_held, exits += report.lumen_exits, ++steps;
        }
        std::printf("margin: %s, steps of %g ms: nearest %.4f sums of radii, %zu contacts so far, %zu held\n", budget, 1e3 * c.step, nearest, contacts, held);
        EXPECT_GE(nearest, 0.99) << devices_text(c);
        EXPECT_EQ(exits, 0u) << devices_text(c);
        EXPECT_LT(held, steps / 10) << devices_text(c);
    }
    EXPECT_GT(contacts, 200u);
}

TEST(RodsMeetScene, WithoutTheEffectTheyLieInOneAnother) {
    TwoDevices c;
    c.effects = R"("coarse_contact", "exact_contact", "friction")";
    const PreparedScene prepared = test::prepare(devices_text(c));
    Simulator simulator(prepared.model);
    double nearest = 10.0;
    for (int step = 0; step < 280; ++step) {
        const StepReport& report = simulator.step();
        nearest = std::min(nearest, test::nearest_of(prepared.model, simulator.state()));
        EXPECT_EQ(report.instrument_contacts, 0u);
        EXPECT_EQ(report.effects.of(effects::instrument_contact), 0u);
    }
    EXPECT_LT(nearest, 0.9);
}

TEST(RodsMeetScene, AForkGoesOnToTheSameBitsAndContactsNameBoth) {
    const PreparedScene prepared = test::prepare(devices_text(TwoDevices()));
    Simulator simulator(prepared.model);
    for (int step = 0; step < 200; ++step) ASSERT_TRUE(simulator.step().finite);
    ASSERT_FALSE(simulator.state().meetings.empty());
    const auto balanced = [](const StepReport& report) { EXPECT_LT(report.balance_n, 1e-2 * std::max(report.contact_force_n, 1e-3)); };
    EXPECT_GT(test::expect_fork_and_contacts(simulator, Thing::instrument(0), Thing::instrument(1), 0.01 * 1.4e-3, balanced), 10u);
}

/// Far from one another each is solved alone: to the bits of a scene without the effect.
TEST(RodsMeetScene, WhatIsFarFromOneAnotherMovesAsWithoutTheEffect) {
    TwoDevices c;
    c.one = c.two = 0.3, c.apart = 3.4;
    std::uint64_t hash[2];
    for (int with = 0; with < 2; ++with) {
        if (with == 0) c.effects = R"("coarse_contact", "exact_contact", "friction")";
        if (with == 1) c.effects = TwoDevices().effects;
        const PreparedScene prepared = test::prepare(devices_text(c));
        Simulator simulator(prepared.model);
        for (int step = 0; step < 40; ++step) EXPECT_EQ(simulator.step().instrument_contacts, 0u);
        hash[with] = hash_state(simulator.state());
    }
    EXPECT_EQ(hash[0], hash[1]);
}

TEST(RodsMeetScene, DevicesThatEnterWithinOneAnotherAreRefused) {
    TwoDevices c;
    c.apart = 0.5;
    const Result<Scene> scene = parse_scene(devices_text(c), "scenes/two.json");
    ASSERT_TRUE(scene.ok());
    const Result<PreparedScene> prepared = make_prepared_scene(*scene);
    ASSERT_FALSE(prepared.ok());
    EXPECT_NE(prepared.error().to_string().find("enters 0.5 mm from where one does; expected at least 1.4 mm"), std::string::npos) << prepared.error().to_string();
}

} // namespace
} // namespace trocar::engine
