// Coils that leave their port, and what comes out of it after them: what the key "detachable" promises, whatever the budget and the step's length.
#include "engine/state/state_bytes.hpp"
#include "meeting_fixture.hpp"

#include <random>

namespace trocar::engine {
namespace {

struct TwoCoils {
    double radius = 0.15, sac = 4.0, loop = 2.5, step = 0.01, first = 40.0, second = 30.0; // mm, s
    std::string budget = "exact", first_keys = R"("detachable": true, )", second_keys = R"("detachable": true, )";
    double starts = 0.0; // mm, the second's insertion at the start
};

std::string text_of(const TwoCoils& c) {
    const auto coil = [&](const char* name, double length, double loop, const std::string& keys, double from) {
        return fmt::format(R"("{}": {{{}"length": {}, "radius": {}, "young_modulus": 5, "density": 10700, "segment": 0.5, "skin_triangles": 1200,
        "tip": {{"shape": "pigtail", "length": {}, "angle": {}, "stiffness": 1}}, "lumen": "sac", "friction": 0.1,
        "entry": {{"position": [0.3, 0, {}], "direction": [0, 0, 1]}}, "path": [[0, {}, 0], [{}, {}, 0]]}})",
                           name, keys, length, c.radius, length - 2.0, (length - 2.0) / loop, 1.0 - c.sac, from, length / 33.0, length);
    };
    return fmt::format(R"({{
    "name": "sac", "units": {{"length": "mm", "pressure": "MPa"}}, "time": {{"step": {}, "duration": 3}}, "budget": "{}",
    "bodies": {{"sac": {{"kind": "static", "hollow": true, "surface": {{"shape": "sphere", "radius": {}, "subdivisions": 3}}}}}},
    "instruments": {{{}, {}}},
    "effects": ["coarse_contact", "exact_contact", "friction", "self_contact", "instrument_contact"]
}})",
                       c.step, c.budget, c.sac, coil("one", c.first, c.loop, c.first_keys, 0.0), coil("two", c.second, 0.8 * c.loop, c.second_keys, c.starts));
}

bool is_out(const SceneModel& model, const State& state, std::size_t i) { return fem::is_free(model.instruments[i].rod, state.instruments[i].rod.insertion); }

TEST(DetachedCoil, TheSecondWaitsForTheFirstAndNeitherPassesThroughTheOther) {
    test::Random random(41);
    std::size_t contacts = 0;
    for (const char* budget : {"exact", "work:0", "work:3000", "exact"}) {
        TwoCoils c;
        c.budget = budget;
        c.radius = random.between(0.1, 0.2), c.loop = random.between(2.0, 3.0), c.sac = random.between(3.5, 5.0), c.step = random.coin() ? 0.01 : 0.005;
        const PreparedScene prepared = test::prepare(text_of(c));
        ASSERT_EQ(prepared.model.instruments.size(), 2u);
        Simulator simulator(prepared.model);
        double nearest = 10.0;
        std::size_t exits = 0, scaled = 0, steps = 0;
        while (simulator.state().time < 3.0 - 1e-9) {
            const bool waits = !is_out(prepared.model, simulator.state(), 0);
            const StepReport& report = simulator.step();
            ASSERT_TRUE(report.finite) << report.failure << text_of(c);
            const State& now = simulator.state();
            if (waits) {
                EXPECT_EQ(now.instruments[1].rod.insertion, 0.0) << now.time;
            } else {
                EXPECT_NEAR(now.instruments[0].rod.insertion, 1e-3 * c.first, 1e-9);
            }
            nearest = std::min(nearest, test::nearest_of(prepared.model, now));
            contacts += report.instrument_contacts, exits += report.lumen_exits, scaled += report.instrument_held, ++steps;
        }
        std::printf("margin: %s, steps of %g ms: nearest %.4f diameters, %zu contacts so far, %zu of %zu steps scaled\n", budget, 1e3 * c.step, nearest, contacts,
                    scaled, steps);
        EXPECT_TRUE(is_out(prepared.model, simulator.state(), 0)) << text_of(c);
        EXPECT_TRUE(is_out(prepared.model, simulator.state(), 1)) << text_of(c);
        EXPECT_GE(nearest, 0.99) << text_of(c);
        EXPECT_EQ(exits, 0u) << text_of(c);
        EXPECT_LT(scaled, steps / 10) << text_of(c);
    }
    EXPECT_GT(contacts, 100u);
}

/// Cut before the first is out, in the step in which it comes out, and after it.
TEST(DetachedCoil, AForkAndItsBytesGoOnToTheSameBits) {
    const PreparedScene prepared = test::prepare(text_of(TwoCoils()));
    Simulator simulator(prepared.model);
    while (!is_out(prepared.model, simulator.state(), 0)) {
        if (simulator.state().time > 2.0) FAIL() << "it never comes out";
        const bool soon = simulator.state().instruments[0].rod.insertion > 39e-3;
        if (!soon) {
            ASSERT_TRUE(simulator.step().finite);
            continue;
        }
        std::string bytes;
        append_state(simulator.state(), bytes);
        const Result<State> read = read_state(prepared.model, bytes);
        ASSERT_TRUE(read.ok()) << read.error().message;
        Simulator fork = simulator.fork(), reader(prepared.model);
        ASSERT_TRUE(reader.restore(*read).ok());
        (void)simulator.step(), (void)fork.step(), (void)reader.step();
        ASSERT_EQ(hash_whole_state(simulator.state()), hash_whole_state(fork.state()));
        ASSERT_EQ(hash_whole_state(simulator.state()), hash_whole_state(reader.state()));
    }
    EXPECT_FALSE(simulator.state().instruments[0].rod.root.isZero(0.0));
    std::string bytes;
    append_state(simulator.state(), bytes);
    const Result<State> read = read_state(prepared.model, bytes);
    ASSERT_TRUE(read.ok()) << read.error().message;
    Simulator reader(prepared.model);
    ASSERT_TRUE(reader.restore(*read).ok());
    for (int step = 0; step < 60; ++step) {
        (void)simulator.step(), (void)reader.step();
        ASSERT_EQ(hash_whole_state(simulator.state()), hash_whole_state(reader.state())) << step;
    }
}

TEST(DetachedCoil, ItsDriveHasNoHoldOfIt) {
    TwoCoils c;
    const PreparedScene prepared = test::prepare(text_of(c));
    Simulator simulator(prepared.model);
    while (!is_out(prepared.model, simulator.state(), 0) && simulator.state().time < 2.0) (void)simulator.step();
    Simulator pulled = simulator.fork();
    Inputs inputs;
    inputs.drive.resize(2);
    for (int step = 0; step < 30; ++step) {
        inputs.drive[0] = DriveCommand{0.01, 3.0};
        ASSERT_TRUE(pulled.step(inputs).ok());
        const StepReport& report = simulator.step();
        EXPECT_EQ(report.handle_force_n, 0.0);
        ASSERT_EQ(simulator.hash(), pulled.hash()) << step;
    }
}

/// Without the key two segments stay in the port.
TEST(DetachedCoil, WhatIsNotDetachableStaysInItsPort) {
    TwoCoils c;
    c.first_keys = "";
    const Result<Scene> scene = parse_scene(text_of(c), "scenes/step.json");
    ASSERT_TRUE(scene.ok());
    const Result<PreparedScene> prepared = make_prepared_scene(*scene);
    ASSERT_FALSE(prepared.ok()); // two in one port
    EXPECT_NE(prepared.error().to_string().find("instruments.two.entry"), std::string::npos) << prepared.error().to_string();
    EXPECT_NE(prepared.error().to_string().find("detachable"), std::string::npos) << prepared.error().to_string();
}

TEST(DetachedCoil, WhatCannotBeIsRefused) {
    const auto refusal = [](const TwoCoils& c) {
        const Result<Scene> scene = parse_scene(text_of(c), "scenes/step.json");
        if (!scene.ok()) return scene.error().to_string();
        const Result<PreparedScene> prepared = make_prepared_scene(*scene);
        return prepared.ok() ? std::string() : prepared.error().to_string();
    };
    TwoCoils c;
    EXPECT_EQ(refusal(c), "");
    c.starts = 2.0;
    EXPECT_NE(refusal(c).find("expected 0"), std::string::npos) << refusal(c);
    c = {};
    c.first_keys += R"("tip_clamp": {}, )";
    EXPECT_NE(refusal(c).find("instruments.one.detachable"), std::string::npos) << refusal(c);
}

} // namespace
} // namespace trocar::engine
