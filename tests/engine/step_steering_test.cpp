// Steering in lumens that are wide against the instrument: progress counts along the route, however far beside it the tip lies.
#include "engine/step/instrument/script.hpp"
#include "step_fixture.hpp"

#include <cmath>
#include <random>

namespace trocar::engine {
namespace {

/// mm. An oval trunk, up 60 mm and round a bend: two parallel vessels, `apart` from each other across the bend, grown into one.
struct Trunk {
    double radius = 10.0, apart = 10.0, bend_radius = 40.0, turn = 2.0; // mm, mm, mm, rad
    double instrument = 0.5;                                            // mm
};

std::string trunk_branch(const Trunk& trunk, double aside) {
    std::string rows;
    const auto add = [&](double x, double z) {
        rows += fmt::format("{}[{:.4f}, {:.4f}, {:.4f}, {}]", rows.empty() ? "" : ", ", x, aside, z, trunk.radius);
    };
    for (const double z : {0.0, 30.0, 60.0}) add(0.0, z);
    constexpr int kParts = 8;
    for (int i = 1; i <= kParts; ++i) {
        const double angle = trunk.turn * i / kParts;
        add(trunk.bend_radius * (1.0 - std::cos(angle)), 60.0 + trunk.bend_radius * std::sin(angle));
    }
    const double x = trunk.bend_radius * (1.0 - std::cos(trunk.turn)), z = 60.0 + trunk.bend_radius * std::sin(trunk.turn);
    for (const double s : {20.0, 40.0}) add(x + s * std::sin(trunk.turn), z + s * std::cos(trunk.turn));
    return "[" + rows + "]";
}

/// The target lies 25 mm beyond the bend, on the side of the oval where the entry is; the entry points to the other side.
std::string trunk_scene(const Trunk& trunk) {
    const double aside = 0.5 * trunk.apart;
    const double x = trunk.bend_radius * (1.0 - std::cos(trunk.turn)) + 25.0 * std::sin(trunk.turn);
    const double z = 60.0 + trunk.bend_radius * std::sin(trunk.turn) + 25.0 * std::cos(trunk.turn);
    return fmt::format(R"({{"name": "trunk", "units": {{"length": "mm", "pressure": "MPa"}}, "time": {{"step": 0.01, "duration": 30}},
        "budget": "exact",
        "bodies": {{"vessel": {{"kind": "static", "hollow": true, "surface": {{"shape": "vessels", "triangles": 3000, "blend": 2,
            "branches": [{}, {}]}}}}}},
        "instruments": {{"catheter": {{"length": 400, "radius": {}, "young_modulus": 80, "segment": 4, "skin_triangles": 800,
            "tip": {{"shape": "J", "length": 15, "angle": 0.8, "stiffness": 0.3}}, "inserted": 8, "lumen": "vessel",
            "entry": {{"position": [0, {}, 10], "direction": [0, -0.5, 1]}}, "follow": {{"target": "end", "speed": 30}}}}}},
        "targets": {{"end": {{"position": [{:.4f}, {:.4f}, {:.4f}]}}}},
        "effects": ["coarse_contact", "exact_contact", "friction"]}})",
                       trunk_branch(trunk, aside), trunk_branch(trunk, -aside), trunk.instrument, aside, x, aside, z);
}

/// How far along the route the tip came, and when it was there first.
struct Travel {
    double farthest = 0.0, at_s = 0.0; // m, s
    unsigned attempts = 0;
};

Travel travel(const SceneModel& model, const Route& route, double seconds) {
    Simulator simulator(model);
    Travel travel;
    double last = 0.0;
    while (simulator.state().time < seconds && travel.farthest < route.length.back() - 3e-3) {
        const StepReport& report = simulator.step();
        if (!report.finite) break;
        last = route.length[find_nearest_point(route, report.tip, last)];
        if (last > travel.farthest) travel.farthest = last, travel.at_s = report.time_s;
        travel.attempts = std::max(travel.attempts, simulator.state().instruments.front().follow.attempts);
    }
    return travel;
}

TEST(SteeringInWideLumens, ArrivesWhereverABlindPushAlongTheSameTrunkArrives) {
    std::mt19937 random(26);
    const auto between = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); };
    int passed = 0;
    for (int k = 0; k < 4; ++k) {
        Trunk trunk;
        trunk.radius = between(5.0, 15.0);
        trunk.apart = between(1.0, 1.4) * trunk.radius;
        trunk.bend_radius = between(1.8, 3.0) * trunk.radius + 10.0;
        trunk.turn = between(1.2, 2.4);
        trunk.instrument = between(0.3, 1.0);
        SCOPED_TRACE(fmt::format("radius {} mm, apart {} mm, bend {} mm, turn {} rad, instrument {} mm", trunk.radius, trunk.apart,
                                 trunk.bend_radius, trunk.turn, trunk.instrument));
        const PreparedScene prepared = test::prepare(trunk_scene(trunk));
        ASSERT_FALSE(prepared.model.instruments.empty());
        const Route& route = *prepared.model.instruments.front().route;
        SceneModel blind = prepared.model;
        const double rate = 0.03, start = blind.instruments.front().inserted, most = 0.38;
        blind.instruments.front().path = {{0.0, start, 0.0}, {(most - start) / rate, most, 0.0}};
        const Travel pushed = travel(blind, route, 12.0), steered = travel(prepared.model, route, 24.0);
        const double end = route.length.back() - 3e-3;
        if (pushed.farthest < end) continue;
        ++passed;
        EXPECT_GE(steered.farthest, end) << "the blind push was there after " << pushed.at_s << " s";
        EXPECT_LE(steered.at_s, 2.0 * pushed.at_s + 3.0);
        EXPECT_EQ(steered.attempts, 0u) << "there is no fork to go astray in";
    }
    EXPECT_GE(passed, 2);
}

/// 100 mm along z; the inscribed spheres of the route are 3 mm, the lumen is wider on one side.
Route make_straight_route() {
    std::vector<Vec3> points;
    for (int i = 0; i <= 100; ++i) points.emplace_back(0.0, 0.0, 1e-3 * i);
    return make_route(std::move(points), std::vector<double>(101, 3e-3));
}

TEST(Steering, ATipAcrossTheLumenMakesProgressAndOneBehindAWallIsAstray) {
    const Route route = make_straight_route();
    const FollowSettings settings{0.025, 0.012, 0.003};
    for (const bool sees_route : {true, false}) {
        FollowState state;
        DriveCommand now{0.01, 0.0};
        state.best_insertion = state.astray_insertion = now.insertion;
        bool retracted = false;
        for (int step = 0; step < 300 && !retracted; ++step) {
            TipView view{{0.008, 0.0, now.insertion}, Vec3::UnitZ(), Vec3::UnitX()};
            view.sees_route = sees_route;
            now = follow_route(route, settings, {0.035, 3.14}, view, now, 0.01, state);
            retracted = state.mode == FollowMode::Retract;
        }
        EXPECT_EQ(retracted, !sees_route);
    }
}

} // namespace
} // namespace trocar::engine
