// Blood drag: there when a scene calls for it, along the vessels, as fast as their widths say.
#include "step_fixture.hpp"

#include <numbers>

namespace trocar::engine {
namespace {

constexpr const char* kInlet = R"("inlet": {"position": [0, 0, 2]})";

std::string vessel_scene(const std::string& surface, const std::string& blood, const std::string& more = "") {
    return fmt::format(R"({{
    "name": "blood", "units": {{"length": "mm", "pressure": "kPa"}}, "time": {{"step": 0.01, "duration": 2}}, "budget": "exact",
    "bodies": {{"vessel": {{"kind": "static", "hollow": true, "surface": {{{}}}}}}},
    "instruments": {{"wire": {{"length": 120, "radius": 0.5, "young_modulus": 60000, "segment": 2.5, "skin_triangles": 800,
        "tip": {{"shape": "straight"}}, "friction": 0, "lumen": "vessel",
        "entry": {{"position": [0, 0, 10], "direction": [0, 0, 1]}}, "inserted": 30}}}},
    "effects": {{"coarse_contact": true, "exact_contact": true, "blood_drag": {{{}}}{}}}
}})",
                       surface, blood, more);
}

const std::string kTube = R"("shape": "tube", "axis": [[0, 0, 0, 3], [0, 0, 40, 3], [0, 0, 80, 3]], "sides": 32)";

std::string with_inlet(const std::string& keys) { return keys + ", " + kInlet; }

const BloodFlow& flow_of(const PreparedScene& prepared) { return *prepared.model.bodies[0].blood; }

/// m^3/s over pi, of a point.
double rate_at(const BloodFlow& flow, Index i) { return flow.speeds[i] * flow.radii[i] * flow.radii[i]; }

TEST(BloodDrag, InAStraightTubeItIsPoiseuillesFlow) {
    const PreparedScene prepared = test::prepare(vessel_scene(kTube, with_inlet(R"("speed": 200)")));
    Simulator simulator(prepared.model);
    simulator.step();
    const InstrumentModel& wire = prepared.model.instruments[0];
    const std::vector<fem::RodFlow>& flow = ScratchView::of(simulator).rods.instruments[0].flow;
    ASSERT_EQ(flow.size(), wire.rod.node_count());
    const Index first = fem::first_inserted_node(wire.rod, 0.03);
    for (Index i = 0; i < first; ++i) EXPECT_EQ(flow[i].velocity, Vec3(Vec3::Zero())) << "before the port";
    for (Index i = first; i < flow.size(); ++i) {
        EXPECT_NEAR(flow[i].velocity.z(), 0.4, 0.04) << "twice the mean in the middle; radii of inscribed spheres are up to a tenth low";
        EXPECT_LT(Vec3(flow[i].velocity - flow[i].velocity.z() * Vec3::UnitZ()).norm(), 0.1 * flow[i].velocity.z());
        EXPECT_NEAR(flow[i].viscous, 2.0 * std::numbers::pi * 3.5e-3 / std::log(6.0), 0.05 * flow[i].viscous);
        EXPECT_NEAR(flow[i].form, 1060.0 * 0.5e-3, 1e-12);
    }
}

TEST(BloodDrag, PullsAtTheShaftWithWhatTheFlowSaysAlongIt) {
    const PreparedScene prepared = test::prepare(vessel_scene(kTube, with_inlet(R"("speed": 200)")));
    Simulator simulator(prepared.model);
    for (int k = 0; k < 60; ++k) EXPECT_EQ(simulator.step().lumen_exits, 0u);
    const fem::RodModel& rod = prepared.model.instruments[0].rod;
    const auto& position = simulator.state().instruments[0].rod.position;
    const std::vector<fem::RodFlow>& flow = ScratchView::of(simulator).rods.instruments[0].flow;
    const Index entry = fem::first_inserted_node(rod, 0.03);
    double drag = 0.0; // N, of all that acts on the segment
    for (Index i = entry + 1; i < flow.size(); ++i)
        drag += flow[i].viscous * flow[i].velocity.z() * rod.segment * (i + 1 < flow.size() ? 1.0 : 0.5);
    const double tension = rod.stretch_stiffness[entry] * ((position[entry + 1] - position[entry]).norm() - rod.segment);
    EXPECT_GT(drag, 1e-5);
    EXPECT_NEAR(tension / drag, 1.0, 0.02);
}

TEST(BloodDrag, WithoutAnInletItFlowsFromTheEntry) {
    const PreparedScene prepared = test::prepare(vessel_scene(kTube, R"("speed": 200)"));
    Simulator simulator(prepared.model);
    simulator.step();
    EXPECT_GT(ScratchView::of(simulator).rods.instruments[0].flow.back().velocity.z(), 0.3);
    const PreparedScene against = test::prepare(vessel_scene(kTube, R"("speed": 200, "inlet": {"position": [0, 0, 78]})"));
    Simulator upstream(against.model);
    upstream.step();
    EXPECT_LT(ScratchView::of(upstream).rods.instruments[0].flow.back().velocity.z(), -0.3);
}

TEST(BloodDrag, WhatComesToAForkLeavesItByTheCubesOfTheRadii) {
    const PreparedScene prepared = test::prepare(vessel_scene(
        R"("shape": "vessels", "triangles": 12000, "blend": 2,
           "branches": [[[0, 0, 0, 3.5], [0, 0, 40, 3.5], [0, 0, 60, 3.5]],
                        [[0, 0, 57, 3], [-20, 0, 80, 3], [-50, 0, 110, 3]],
                        [[0, 0, 57, 2], [20, 0, 80, 2], [50, 0, 110, 2]]])",
        with_inlet(R"("speed": 200)")));
    const BloodFlow& flow = flow_of(prepared);
    std::size_t forks = 0, ends = 0;
    double left = 0.0, right = 0.0;
    for (Index i = 0; i < flow.point_count(); ++i) {
        double out = 0.0;
        for (const Index child : flow.children_of(i)) out += rate_at(flow, child);
        forks += flow.children_of(i).size() > 1;
        if (!flow.children_of(i).empty()) {
            EXPECT_NEAR(out / rate_at(flow, i), 1.0, 1e-9) << "point " << i;
            continue;
        }
        ++ends;
        (flow.points[i].x() < 0.0 ? left : right) += rate_at(flow, i);
    }
    EXPECT_EQ(forks, 1u);
    EXPECT_EQ(ends, 2u);
    EXPECT_NEAR(left / right, 27.0 / 8.0, 0.15 * 27.0 / 8.0);
}

TEST(BloodDrag, ANarrowPlaceIsAFastOne) {
    const PreparedScene prepared = test::prepare(vessel_scene(
        R"("shape": "tube", "axis": [[0, 0, 0, 3], [0, 0, 50, 3], [0, 0, 60, 1.5], [0, 0, 70, 1.5], [0, 0, 80, 3], [0, 0, 120, 3]], "sides": 32)",
        with_inlet(R"("speed": 100)")));
    const BloodFlow& flow = flow_of(prepared);
    const Index wide = find_flow_point(flow, Vec3(0, 0, 0.03)), narrow = find_flow_point(flow, Vec3(0, 0, 0.065));
    EXPECT_NEAR(flow.speeds[wide], 0.1, 0.01);
    EXPECT_NEAR(flow.speeds[narrow] / flow.speeds[wide], 4.0, 0.5);
}

TEST(BloodDrag, BeatsWithThePulse) {
    const PreparedScene prepared = test::prepare(
        vessel_scene(kTube, with_inlet(R"("speed": 200, "pulsatility": 0.5)"), R"(, "pulse": {"amplitude": 0.01, "period": 0.5})"));
    Simulator simulator(prepared.model);
    double slowest = 1.0, fastest = 0.0, sum = 0.0;
    for (int k = 0; k < 50; ++k) {
        simulator.step();
        const double speed = ScratchView::of(simulator).rods.instruments[0].flow.back().velocity.z();
        slowest = std::min(slowest, speed);
        fastest = std::max(fastest, speed);
        sum += speed;
    }
    EXPECT_NEAR(fastest / slowest, 3.0, 0.05);
    EXPECT_NEAR(sum / 50.0, 0.4, 0.05);
}

/// A vessel in an organ that breathes: the flow moves along.
TEST(BloodDrag, MovesWithTheOrganThatCarriesTheVessel) {
    const PreparedScene prepared = test::prepare(test::bent_tube_scene(
        {.effects = R"("elasticity", "damping", "breathing", "coarse_contact", "exact_contact", "blood_drag")", .host_body = test::kOrgan}));
    ASSERT_TRUE(prepared.model.bodies[1].blood && prepared.model.bodies[1].blood->links);
    Simulator simulator(prepared.model);
    for (int k = 0; k < 100; ++k) ASSERT_EQ(simulator.step().lumen_exits, 0u);
    double farthest = 0.0;
    const std::vector<Vec3>& rest = prepared.model.bodies[1].blood->points;
    const std::vector<Vec3>& now = ScratchView::of(simulator).rods.walls[1].flow_points;
    ASSERT_EQ(now.size(), rest.size());
    for (std::size_t i = 0; i < rest.size(); ++i) farthest = std::max(farthest, (now[i] - rest[i]).norm());
    EXPECT_GT(farthest, 1e-3) << "of a breath of 10 mm";
    EXPECT_LT(farthest, 12e-3);
}

TEST(BloodDrag, WhatIsWrongIsNamedWithItsPlace) {
    const auto refusal = [](const std::string& text) {
        const Result<Scene> scene = parse_scene(text, "scenes/blood.json");
        if (!scene.ok()) return scene.error().to_string();
        const Result<PreparedScene> prepared = make_prepared_scene(*scene);
        return prepared.ok() ? std::string() : prepared.error().to_string();
    };
    const auto says = [](const std::string& message, const char* words) { return message.find(words) != std::string::npos; };
    const std::string pulseless = refusal(vessel_scene(kTube, R"("pulsatility": 0.5)"));
    EXPECT_TRUE(says(pulseless, "blood.json:7:") && says(pulseless, "effects.blood_drag.pulsatility") &&
                says(pulseless, "the effect pulse is off"))
        << pulseless;
    const std::string outside = refusal(vessel_scene(kTube, R"("inlet": {"position": [0, 60, 20]})"));
    EXPECT_TRUE(says(outside, "blood.json:7:") && says(outside, "effects.blood_drag.inlet") && says(outside, "lies in no vessel"))
        << outside;
    const std::string honey = refusal(vessel_scene(kTube, R"("viscosity": 5000)"));
    EXPECT_TRUE(says(honey, "effects.blood_drag.viscosity")) << honey;
}

TEST(BloodDrag, RunsUnderAWorkBudgetGiveTheSameBitsTwice) {
    std::string text = vessel_scene(kTube, with_inlet(R"("speed": 300)"));
    text.replace(text.find("\"exact\""), 7, "\"work:5000\"");
    const PreparedScene prepared = test::prepare(text);
    Simulator a(prepared.model), b(prepared.model);
    for (int k = 0; k < 40; ++k) {
        a.step();
        b.step();
    }
    EXPECT_EQ(hash_state(a.state()), hash_state(b.state()));
}

} // namespace
} // namespace trocar::engine
