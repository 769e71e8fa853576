// Coils in round sacs: what the effect self_contact promises of instruments, whatever the budget and the step's length.
#include "fem/rod/chain_pairs.hpp"
#include "step_fixture.hpp"
#include "tests/fem/rod_apart.hpp"

#include <random>

namespace trocar::engine {
namespace {

struct CoilInSac {
    double radius = 0.15, sac = 4.0, loop = 2.5, modulus = 5.0, friction = 0.1, step = 0.01, speed = 30.0; // mm, MPa, s, mm/s
    std::string budget = "exact";
    bool twists = false, meets_itself = true;
};

std::string text_of(const CoilInSac& c) {
    const double length = 90.0;
    return fmt::format(R"({{
    "name": "sac", "units": {{"length": "mm", "pressure": "MPa"}}, "time": {{"step": {}, "duration": {}}}, "budget": "{}",
    "bodies": {{"sac": {{"kind": "static", "hollow": true, "surface": {{"shape": "sphere", "radius": {}, "subdivisions": 3}}}}}},
    "instruments": {{"coil": {{"length": {}, "radius": {}, "young_modulus": {}, "density": 10700, "segment": 0.6, "skin_triangles": 1500,
        "tip": {{"shape": "pigtail", "length": {}, "angle": {}, "stiffness": 1}}, "lumen": "sac", "friction": {}, "inserted": 1,
        "entry": {{"position": [0.3, 0, {}], "direction": [0, 0, 1]}}, "path": [[0, 1, 0], [{}, {}, {}]]}}}},
    "effects": ["coarse_contact", "exact_contact", "friction"{}{}]
}})",
                       c.step, 2.0, c.budget, c.sac, length, c.radius, c.modulus, length - 5.0, (length - 5.0) / c.loop, c.friction, 1.0 - c.sac, 2.0,
                       1.0 + 2.0 * c.speed, c.twists ? 2.0 : 0.0, c.twists ? ", \"twist\"" : "", c.meets_itself ? ", \"self_contact\"" : "");
}

struct Outcome {
    double nearest = 10.0; // diameters
    std::size_t contacts = 0, held = 0, exits = 0, steps = 0;
};

/// Of two seconds.
Outcome fill(const CoilInSac& c) {
    const PreparedScene prepared = test::prepare(text_of(c));
    Simulator simulator(prepared.model);
    const fem::RodModel& rod = prepared.model.instruments[0].rod;
    const std::size_t gap = fem::ChainRule{rod.design.radius, rod.segment}.least_gap();
    Outcome outcome;
    while (simulator.state().time < 2.0 - 1e-9) {
        const StepReport& report = simulator.step();
        EXPECT_TRUE(report.finite) << report.failure;
        if (!report.finite) return outcome;
        const fem::RodState& now = simulator.state().instruments[0].rod;
        outcome.nearest = std::min(outcome.nearest, fem::nearest_by_search(now.position, gap) / (2.0 * rod.design.radius));
        outcome.contacts += report.self_contacts, outcome.held += report.self_held, outcome.exits += report.lumen_exits, ++outcome.steps;
    }
    return outcome;
}

TEST(RodSelfScene, NoLoopPassesThroughAnotherOneAtAnyBudgetAndStep) {
    std::mt19937_64 rng(30);
    const auto between = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(rng); };
    std::size_t contacts = 0;
    for (const char* budget : {"exact", "work:0", "work:3000", "exact"}) {
        CoilInSac c;
        c.budget = budget;
        c.radius = between(0.1, 0.25), c.loop = between(2.0, 3.5), c.sac = between(3.0, 5.0), c.modulus = between(0.5, 30.0);
        c.friction = between(0.0, 0.3), c.step = between(0.0, 1.0) < 0.5 ? 0.01 : 0.004;
        SCOPED_TRACE(text_of(c));
        const Outcome outcome = fill(c);
        std::printf("margin: %s, steps of %g ms: nearest %.4f diameters, %zu contacts in %zu steps, %zu held back\n", budget, 1e3 * c.step, outcome.nearest,
                    outcome.contacts, outcome.steps, outcome.held);
        EXPECT_GE(outcome.nearest, 0.99);
        EXPECT_EQ(outcome.exits, 0u);
        EXPECT_LT(outcome.held, outcome.steps / 10);
        contacts += outcome.contacts;
    }
    EXPECT_GT(contacts, 200u);
}

TEST(RodSelfScene, WithoutTheEffectLoopsLieInOneAnother) {
    CoilInSac c;
    c.meets_itself = false;
    const Outcome outcome = fill(c);
    EXPECT_LT(outcome.nearest, 0.5);
    EXPECT_EQ(outcome.contacts, 0u);
}

TEST(RodSelfScene, AForkAndARestoredStateGoOnToTheSameBits) {
    CoilInSac c;
    c.twists = true;
    const PreparedScene prepared = test::prepare(text_of(c));
    Simulator simulator(prepared.model);
    for (int step = 0; step < 120; ++step) ASSERT_TRUE(simulator.step().finite);
    ASSERT_FALSE(simulator.state().instruments[0].self_planes.empty());
    Simulator fork = simulator.fork();
    for (int step = 0; step < 20; ++step) {
        (void)simulator.step(), (void)fork.step();
        ASSERT_EQ(simulator.hash(), fork.hash()) << "step " << step;
    }
}

/// Both places of a pair feel the same force, one along the normal and the other against it: what holds the rod feels nothing of them.
TEST(RodSelfScene, ContactsOfARodWithItselfNameBothPlacesAndBalance) {
    const PreparedScene prepared = test::prepare(text_of({}));
    Simulator simulator(prepared.model);
    std::size_t seen = 0;
    for (int step = 0; step < 180; ++step) {
        const StepReport& report = simulator.step();
        ASSERT_TRUE(report.finite);
        std::size_t own = 0;
        for (const Contact& contact : simulator.contacts())
            if (contact.a == Thing::instrument(0) && contact.b == contact.a) {
                ++own;
                EXPECT_GT(contact.force.dot(contact.normal), 0.0);
                EXPECT_GE(contact.feature_b[0], contact.feature_a[0] + 2);
                EXPECT_LT(std::abs(contact.gap), 0.02 * 0.15e-3);
            }
        EXPECT_EQ(own, report.self_contacts);
        seen += own;
        EXPECT_LT(report.balance_n, 1e-3 * std::max(report.contact_force_n, 1e-3));
    }
    EXPECT_GT(seen, 50u);
}

/// A straight rod along a ball's diameter, its port within the ball or before it: what waits in its device does not count.
TEST(RodSelfScene, PackingIsTheShareOfWhatHasComeIntoTheBall) {
    for (const double port : {-4.0, -1.0}) {
        for (const double ball : {1.0, 2.0}) {
            const std::string text = fmt::format(R"({{
    "name": "ball", "units": {{"length": "mm", "pressure": "MPa"}}, "time": {{"step": 0.01, "duration": 1}}, "budget": "exact",
    "bodies": {{"sac": {{"kind": "static", "hollow": true, "surface": {{"shape": "sphere", "radius": 12, "subdivisions": 3}}}}}},
    "instruments": {{"wire": {{"length": 60, "radius": 0.15, "young_modulus": 5000, "segment": 0.6, "skin_triangles": 1500, "tip": {{"shape": "straight"}},
        "lumen": "sac", "inserted": 6, "entry": {{"position": [0, 0, {}], "direction": [0, 0, 1]}}, "path": [[0, 6, 0], [1, 6, 0]]}}}},
    "effects": ["coarse_contact"], "outputs": {{"packing": {{"centre": [0, 0, 0], "radius": {}}}}}
}})",
                                                 port, ball);
            const PreparedScene prepared = test::prepare(text);
            Simulator simulator(prepared.model);
            const double within = std::min(ball, 6.0 + port) - std::max(-ball, port), wanted = 0.75 * within * 0.15 * 0.15 / (ball * ball * ball);
            EXPECT_NEAR(simulator.step().packing_density, wanted, wanted * 1.2 / within) << port << ", " << ball; // segments of 0.6 mm at both ends
        }
    }
}

} // namespace
} // namespace trocar::engine
