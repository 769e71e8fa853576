// A wire with play in a catheter's bore, in a vessel: what is promised whatever the budget, the step's length and the drives.
#include "meeting_fixture.hpp"
#include "tests/fem/rod_apart.hpp"

#include <random>

namespace trocar::engine {
namespace {

struct OverTheWire {
    double bore = 0.5, wire = 0.3, friction = 0.1, step = 0.01, speed = 20.0; // mm, s, mm/s
    std::string budget = "exact", effects = R"("coarse_contact", "exact_contact", "friction")", more;
};

std::string over_the_wire(const OverTheWire& c) {
    const double out = 40.0 / c.speed;
    return fmt::format(R"({{
    "name": "over", "units": {{"length": "mm", "pressure": "MPa"}}, "time": {{"step": {}, "duration": {}}}, "budget": "{}",
    "bodies": {{"vessel": {{"kind": "static", "hollow": true, "surface": {{"shape": "vessels", "triangles": 4000, "blend": 1,
        "branches": [[[0, 0, 0, 3], [0, 0, 40, 3], [10, 0, 70, 3], [30, 0, 90, 3], [60, 0, 100, 3]]]}}}}}},
    "instruments": {{
        "catheter": {{"length": 160, "radius": {}, "inner_radius": {}, "young_modulus": 40, "segment": 2.5, "skin_triangles": 2000, "friction": {},
            "tip": {{"shape": "J", "length": 10, "angle": 0.7}}, "lumen": "vessel", "entry": {{"position": [0, 0.2, 6], "direction": [0, 0, 1]}},
            "limits": {{"speed": 10000, "rotation": 1000}}, "path": [[0, 5, 0], [{}, 45, 0], [{}, 85, 1]]}},
        "wire": {{"inside": "catheter", "length": 200, "radius": {}, "young_modulus": 500, "segment": 2, "skin_triangles": 2000, "friction": {},
            "limits": {{"speed": 10000, "rotation": 1000}}, "path": [[0, 3, 0], [{}, 80, 2], [{}, 60, -2]]{}}}}},
    "effects": [{}]
}})",
                       c.step, 2.0 * out, c.budget, c.bore + 0.3, c.bore, c.friction, out, 2.0 * out, c.wire, c.friction, out, 2.0 * out, c.more, c.effects);
}

/// Plays, from the outer one's curve, of the wire's nodes in the bore but for one segment behind its mouth.
double farthest_in_bore(const SceneModel& model, const State& state) {
    const fem::RodModel &out = model.instruments[0].rod, &in = model.instruments[1].rod;
    const fem::RodState &outer = state.instruments[0].rod, &inner = state.instruments[1].rod;
    double most = 0.0;
    for (Index i = fem::first_inserted_node(in, inner.insertion); i < in.node_count(); ++i)
        if (fem::arc_of(in, inner.insertion, i) < outer.insertion - std::max(in.segment, out.segment))
            most = std::max(most, fem::distance_to_curve(outer.position, inner.position[i]) / model.instruments[1].play);
    return most;
}

TEST(BoreScene, TheWireStaysInTheBoreAtAnyBudgetStepAndSpeed) {
    std::mt19937_64 rng(7);
    const auto between = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(rng); };
    std::size_t contacts = 0;
    for (const char* budget : {"exact", "work:0", "work:3000", "exact", "exact"}) {
        OverTheWire c;
        c.budget = budget;
        c.bore = between(0.4, 0.7), c.wire = c.bore * between(0.4, 0.9), c.friction = between(0.0, 0.3), c.step = between(0.002, 0.01);
        if (contacts > 0 && between(0.0, 1.0) < 0.5) c.effects += R"(, "twist")";
        const PreparedScene prepared = test::prepare(over_the_wire(c));
        ASSERT_NEAR(prepared.model.instruments[1].play, 1e-3 * (c.bore - c.wire), 1e-9);
        Simulator simulator(prepared.model);
        double most = 0.0, excess = 0.0, unbalanced = 0.0;
        std::size_t exits = 0, steps = 0, held = 0;
        while (simulator.state().time < 80.0 / c.speed - 1e-9) {
            const StepReport& report = simulator.step();
            ASSERT_TRUE(report.finite) << report.failure;
            most = std::max(most, farthest_in_bore(prepared.model, simulator.state()));
            excess = std::max(excess, report.bore_excess_m);
            contacts += report.instrument_contacts, exits += report.lumen_exits, held += report.instrument_held, ++steps;
            if (report.unsettled_rods == 0) unbalanced = std::max(unbalanced, report.balance_n / (1e-3 + report.contact_force_n + report.instrument_force_n));
        }
        std::printf("margin: %s, steps of %.1f ms: farthest %.4f plays, excess %.2e mm, %zu contacts so far, %zu of %zu held, balance %.1e\n", budget, 1e3 * c.step,
                    most, 1e3 * excess, contacts, held, steps, unbalanced);
        EXPECT_LT(most, 1.1) << over_the_wire(c);
        EXPECT_LT(excess, 0.05e-3 * (c.bore - c.wire)) << over_the_wire(c);
        EXPECT_EQ(exits, 0u) << over_the_wire(c);
        EXPECT_EQ(held, 0u) << over_the_wire(c);
        EXPECT_LT(unbalanced, 1e-2);
    }
    EXPECT_GT(contacts, 1000u);
}

/// Commands a hundred times beyond what a surgeon's hand does are cut to what a step may move, and said.
TEST(BoreScene, DrivesBeyondAllSpeedAreCutAndTheWireStaysIn) {
    OverTheWire c;
    c.speed = 2500.0;
    c.effects += R"(, "twist")";
    const PreparedScene prepared = test::prepare(over_the_wire(c));
    Simulator simulator(prepared.model);
    double most = 0.0;
    unsigned limited = 0;
    for (int step = 0; step < 150; ++step) {
        const StepReport& report = simulator.step();
        ASSERT_TRUE(report.finite) << report.failure;
        most = std::max(most, farthest_in_bore(prepared.model, simulator.state()));
        limited += report.drive_limited;
        EXPECT_EQ(report.lumen_exits, 0u);
    }
    EXPECT_LT(most, 1.3); // at 1 mm a step
    EXPECT_GT(limited, 20u);
}

TEST(BoreScene, AForkGoesOnToTheSameBitsAndContactsNameBoth) {
    const PreparedScene prepared = test::prepare(over_the_wire({}));
    Simulator simulator(prepared.model);
    for (int step = 0; step < 200; ++step) ASSERT_TRUE(simulator.step().finite);
    EXPECT_GT(test::expect_fork_and_contacts(simulator, Thing::instrument(1), Thing::instrument(0), 0.02 * 0.2e-3, [](const StepReport&) {}), 30u);
}

/// All pairs with play are one solve: each is held by the wall of its own lumen, whichever of them leads, and whether that wall moves.
TEST(BoreScene, PairsInTwoLumensStayEachInItsOwn) {
    const auto pair = [](const char* outer, const char* wire, const char* lumen, double x, double far) {
        return fmt::format(R"("{0}": {{"length": 150, "radius": 0.6, "inner_radius": 0.4, "young_modulus": 600, "tip": {{"shape": "J", "length": 10, "angle": 0.6}},
            "segment": 2, "skin_triangles": 2000, "entry": {{"position": [{3}, 0, 4], "direction": [0, 0, 1]}}, "lumen": "{2}", "path": [[0, 8, 0], [2, {4}, 0]]}},
            "{1}": {{"inside": "{0}", "length": 180, "radius": 0.25, "young_modulus": 4000, "segment": 2, "skin_triangles": 2000, "path": [[0, 8, 0], [2, {4}, 0]]}})",
                           outer, wire, lumen, x, far);
    };
    const std::string still = pair("c", "w", "still", -200.0, 9.0), moving = pair("catheter", "wire", "artery", 0.0, 55.0);
    for (const auto& [first, second] : {std::pair(still, moving), std::pair(moving, still)}) {
        const PreparedScene prepared = test::prepare(fmt::format(R"({{"name": "two", "units": {{"length": "mm", "pressure": "kPa"}}, "time": {{"step": 0.01, "duration": 2}},
            "bodies": {{
                "artery": {{"kind": "deformable", "hollow": true,
                    "surface": {{"shape": "vessels", "triangles": 3000, "branches": [[[0, 0, 0, 4], [0, 0, 25, 4], [5, 0, 45, 4], [16, 0, 60, 4], [30, 0, 70, 4]]]}},
                    "material": {{"young_modulus": 200, "poisson_ratio": 0.45, "density": 1100, "viscosity": 0.02, "mass_damping": 20}},
                    "coarse": {{"mesher": "wall", "thickness": 1, "layers": 1, "surface_triangles": 400}},
                    "fixed": [{{"box": [[-10, -10, -10], [10, 10, 3]]}}, {{"sphere": {{"centre": [30, 0, 70], "radius": 6}}}}]}},
                "still": {{"kind": "static", "hollow": true, "surface": {{"shape": "vessels", "triangles": 3000, "branches": [[[-200, 0, 0, 4], [-200, 0, 80, 4]]]}}}}}},
            "instruments": {{{}, {}}}, "budget": "exact",
            "effects": {{"elasticity": true, "damping": true, "coarse_contact": true, "exact_contact": true, "friction": true,
                "breathing": {{"amplitude": 4, "period": 4, "direction": [1, 0, 0]}}}}}})",
                                                                 first, second));
        ASSERT_EQ(prepared.model.instruments.size(), 4u);
        Simulator simulator(prepared.model);
        std::size_t exits = 0;
        for (int step = 0; step < 170; ++step) {
            const StepReport& report = simulator.step();
            ASSERT_TRUE(report.finite) << report.failure;
            exits += report.lumen_exits;
        }
        EXPECT_EQ(exits, 0u);
    }
}

/// A bore is no effect: without any of them the wire stays in it.
TEST(BoreScene, WithoutAnyEffectTheWireStaysInTheBore) {
    OverTheWire c;
    c.effects.clear();
    const PreparedScene prepared = test::prepare(over_the_wire(c));
    Simulator simulator(prepared.model);
    double most = 0.0, force = 0.0;
    for (int step = 0; step < 300; ++step) {
        const StepReport& report = simulator.step();
        ASSERT_TRUE(report.finite) << report.failure;
        most = std::max(most, farthest_in_bore(prepared.model, simulator.state()));
        force += report.instrument_force_n;
    }
    EXPECT_LT(most, 1.1);
    EXPECT_GT(force, 0.0);
}

TEST(BoreScene, PlayIsWhatTheBoreLeavesAndMayBeLeftOut) {
    OverTheWire c;
    EXPECT_GT(test::prepare(over_the_wire(c)).model.instruments[1].play, 0.0);
    c.more = R"(, "play": false)";
    const PreparedScene one_axis = test::prepare(over_the_wire(c));
    EXPECT_EQ(one_axis.model.instruments[1].play, 0.0);
    EXPECT_EQ(one_axis.model.instruments[0].wire, std::optional<std::size_t>(1));
    Simulator simulator(one_axis.model);
    for (int step = 0; step < 50; ++step) EXPECT_EQ(simulator.step().instrument_contacts, 0u);
    const auto refusal = [](std::string text) {
        const Result<Scene> scene = parse_scene(text, "scenes/over.json");
        return scene.ok() ? std::string() : scene.error().to_string();
    };
    c.more = R"(, "play": true)";
    std::string text = over_the_wire(c);
    text.replace(text.find(R"("inner_radius": 0.5, )"), std::string(R"("inner_radius": 0.5, )").size(), "");
    EXPECT_NE(refusal(text).find("found true, but catheter states no inner_radius; expected one, or false"), std::string::npos) << refusal(text);
    text = over_the_wire({});
    text.insert(text.find(R"("tip")"), R"("play": true, )");
    EXPECT_NE(refusal(text).find("unused: it runs inside no instrument"), std::string::npos) << refusal(text);
}

} // namespace
} // namespace trocar::engine
