// Instruments that meet solids from outside: the free space around them is the lumen.
#include "base/inside.hpp"
#include "engine/prepare/free_space.hpp"
#include "step_fixture.hpp"

#include <random>

namespace trocar::engine {
namespace {

constexpr double kSpeed = 20.0; // mm/s, of the push

struct Needle {
    double step = 0.01;                          // s
    double modulus_mpa = 2000.0;
    double wall_stiffness = 20.0;                // N/mm
    std::string budget = "exact";
    Vec3 towards = -Vec3::UnitZ();               // from its entry, 60 mm from the ball's middle
    Vec3 aside = Vec3(5.0, 0.0, 0.0);            // mm
    double depth = 33.0;                         // mm, of its path: 3 mm deep
    std::string ball = R"("kind": "deformable", "material": {"young_modulus": 10, "poisson_ratio": 0.4, "density": 1000, "viscosity": 0.02},
        "coarse": {"mesher": "lattice", "surface_triangles": 800}, "fixed": [{"sphere": {"centre": [0, 0, 0], "radius": 10}}],)";
    std::string surface = R"("shape": "sphere", "centre": [0, 0, 0], "radius": 30, "subdivisions": 4)";
};

std::string row(const Vec3& v) { return fmt::format("[{}, {}, {}]", v.x(), v.y(), v.z()); }

/// A ball of 30 mm round the origin, or another solid, and a stiff rod of 1 mm that is pushed into it from outside, then held.
std::string needle_scene(const Needle& needle) {
    return fmt::format(R"({{
    "name": "needle", "units": {{"length": "mm", "pressure": "kPa"}}, "time": {{"step": {}, "duration": 6}}, "budget": "{}",
    "contact": {{"wall_stiffness": {}}},
    "bodies": {{
        "ball": {{{} "surface": {{{}}}}},
        "space": {{"kind": "static", "hollow": true, "surface": {{"around": ["ball"], "margin": 50}}}}}},
    "instruments": {{"needle": {{"length": 150, "radius": 1, "young_modulus": {}000, "density": 1100, "segment": 2.5, "skin_triangles": 2000,
        "tip": {{"shape": "straight"}}, "stiffness": [[0, 1]], "inserted": 5, "friction": 0.2, "lumen": "space",
        "entry": {{"position": {}, "direction": {}}}, "path": [[0, 5, 0], [{}, {}, 0], [20, {}, 0]]}}}},
    "effects": ["elasticity", "damping", "coarse_contact", "exact_contact", "friction"]
}})",
                       needle.step, needle.budget, needle.wall_stiffness, needle.ball, needle.surface, needle.modulus_mpa, row(-60.0 * needle.towards + needle.aside),
                       row(needle.towards), (needle.depth - 5.0) / kSpeed, needle.depth, needle.depth);
}

/// Vertices of the needle's skin in the ball, by that one's own surface.
std::size_t count_in_ball(const SceneModel& model, const State& state) {
    TriMesh ball = model.bodies[0].surface;
    ball.vertices = state.bodies[0].surface;
    const InsideTest inside(ball);
    return static_cast<std::size_t>(std::count_if(state.instruments[0].skin.begin(), state.instruments[0].skin.end(),
                                                  [&](const Vec3& v) { return inside.inside(v); }));
}

struct Pressed {
    double held = 0.0, least = INFINITY, most = -INFINITY; // N, of the last half second
    double highest = 0.0;                                  // N
    double depth = 0.0;                                    // m, of the tip below where the ball's surface was
    double gap = 0.0;                                      // N, the largest of the last half second
    std::size_t inside = 0;                                // vertices in the ball, of every 25th step
};

Pressed press(const Needle& needle, double seconds = 4.0) {
    const PreparedScene prepared = test::prepare(needle_scene(needle));
    Simulator simulator(prepared.model);
    const int count = static_cast<int>(seconds / needle.step), rests = static_cast<int>((seconds - 0.5) / needle.step);
    Pressed pressed;
    for (int k = 0; k < count; ++k) {
        const StepReport& report = simulator.step();
        EXPECT_TRUE(report.finite) << report.failure;
        if (!report.finite) return pressed;
        EXPECT_EQ(report.lumen_exits, 0U) << "step " << k;
        pressed.highest = std::max(pressed.highest, report.handle_force_n);
        if (k % 25 == 24) pressed.inside += count_in_ball(prepared.model, simulator.state());
        if (k < rests) continue;
        pressed.held += report.handle_force_n / (count - rests);
        pressed.least = std::min(pressed.least, report.handle_force_n), pressed.most = std::max(pressed.most, report.handle_force_n);
        pressed.gap = std::max(pressed.gap, report.exchange_gap_n);
        pressed.depth = 0.03 - report.tip.norm();
    }
    return pressed;
}

/// What the rod meets is where the solid is.
void expect_wall_on_solid(const Needle& needle) {
    const PreparedScene prepared = test::prepare(needle_scene(needle));
    const BodyModel &ball = prepared.model.bodies[0], &space = prepared.model.bodies[1];
    ASSERT_EQ(space.host_body, std::size_t{0});
    EXPECT_TRUE(space.is_free_space);
    const std::size_t shared = ball.surface.vertices.size();
    ASSERT_GT(space.surface.vertices.size(), shared);
    Simulator simulator(prepared.model);
    double moved = 0.0;
    for (int k = 0; k < 300; ++k) {
        ASSERT_TRUE(simulator.step().finite);
        if (k % 10 != 9) continue;
        const std::vector<Vec3>&own = simulator.state().bodies[0].surface, &wall = simulator.state().bodies[1].surface;
        for (std::size_t v = 0; v < shared; ++v) {
            ASSERT_EQ(own[v], wall[v]) << "vertex " << v << ", step " << k;
            moved = std::max(moved, (own[v] - ball.surface.vertices[v]).norm());
        }
        for (std::size_t v = shared; v < wall.size(); ++v) ASSERT_EQ(wall[v], space.surface.vertices[v]);
    }
    EXPECT_GT(moved, 2e-3) << "m: it was pressed in";
}

TEST(AroundSolids, TheWallIsTheSolidsSurfaceInEveryStep) { expect_wall_on_solid({}); }

constexpr const char* kBox = R"("shape": "box", "centre": [0, 0, 0], "extent": [60, 60, 60], "cells": 3)"; // its rims follow tetrahedra beneath them
TEST(AroundSolids, TheWallIsTheSurfaceOfASolidWithSharpEdges) { expect_wall_on_solid({.aside = Vec3(16, 14, 0), .surface = kBox}); }

/// Where the wall's vertices are ends of sharp edges that stand off the coarse mesh.
TEST(AroundSolids, APressBesideASharpEdgeIsTheSameAtEveryStepLength) {
    const Needle beside{.aside = Vec3(26, 4, 0), .surface = kBox};
    const Pressed first = press(beside);
    EXPECT_GT(first.held, 0.01) << "N";
    for (const double step : {0.005, 0.002}) {
        Needle other = beside;
        other.step = step;
        const Pressed pressed = press(other);
        EXPECT_NEAR(pressed.held, first.held, 0.05 * first.held) << "N, steps of " << step;
        EXPECT_LT(pressed.most - pressed.least, 0.1 * pressed.held) << "N";
        EXPECT_LT(pressed.gap, 0.35 * pressed.held) << "N";
    }
}

/// Whatever the step, the rod and the stiffness with which both answer: one force and one depth, and nothing within the ball.
TEST(AroundSolids, APressComesToTheSameForceWhateverIsNumerical) {
    const Pressed first = press({});
    EXPECT_GT(first.held, 0.01) << "N";
    EXPECT_GT(first.depth, 2e-3) << "m";
    for (const Needle& other : {Needle{}, Needle{.step = 0.005}, Needle{.step = 0.002}, Needle{.modulus_mpa = 200000}, Needle{.wall_stiffness = 0.2}, Needle{.wall_stiffness = 200}}) {
        SCOPED_TRACE(fmt::format("steps of {} s, {} MPa, {} N/mm", other.step, other.modulus_mpa, other.wall_stiffness));
        const Pressed pressed = press(other);
        EXPECT_NEAR(pressed.held, first.held, 0.03 * first.held) << "N";
        EXPECT_NEAR(pressed.depth, first.depth, 0.15e-3) << "m";
        EXPECT_LT(pressed.most - pressed.least, 0.1 * pressed.held) << "N";
        EXPECT_LT(pressed.highest, 1.2 * pressed.held) << "N, while it was pushed";
        EXPECT_LT(pressed.gap, 0.35 * pressed.held) << "N";
        EXPECT_EQ(pressed.inside, 0U);
    }
}

/// The axes are none of physics' business: icosphere and lattice are the same when they change places in turn.
TEST(AroundSolids, APressIsTheSameAlongEveryAxis) {
    const Pressed z = press({}, 3.0);
    const Pressed x = press({.towards = -Vec3::UnitX(), .aside = Vec3(0.0, 5.0, 0.0)}, 3.0);
    const Pressed y = press({.towards = -Vec3::UnitY(), .aside = Vec3(0.0, 0.0, 5.0)}, 3.0);
    EXPECT_NEAR(x.held, z.held, 0.01 * z.held);
    EXPECT_NEAR(y.held, z.held, 0.01 * z.held);
}

/// Straight at it, aslant and past it, from anywhere, at any budget: what is rigid is never entered, and whoever slides off goes on.
TEST(AroundSolids, NoRodEntersASolidFromAnyDirectionAtAnyBudget) {
    std::mt19937 random(20261127);
    std::uniform_real_distribution<double> offset(-32.0, 32.0);
    std::normal_distribution<double> normal;
    std::size_t met = 0;
    for (const char* budget : {"exact", "work:1000", "work:0", "exact", "work:100000", "work:0"}) {
        Needle needle{.modulus_mpa = 60, .budget = budget, .depth = 90.0, .ball = R"("kind": "static",)"};
        needle.towards = Vec3(normal(random), normal(random), normal(random)).normalized();
        const Vec3 e = needle.towards.unitOrthogonal(), f = needle.towards.cross(e);
        needle.aside = offset(random) * e + offset(random) * f;
        SCOPED_TRACE(fmt::format("{}: towards {}, aside {}", budget, row(needle.towards), row(needle.aside)));
        const PreparedScene prepared = test::prepare(needle_scene(needle));
        Simulator simulator(prepared.model);
        double highest = 0.0;
        for (int k = 0; k < 500; ++k) {
            const StepReport& report = simulator.step();
            ASSERT_TRUE(report.finite) << report.failure;
            EXPECT_EQ(report.lumen_exits, 0U) << "step " << k;
            highest = std::max(highest, report.handle_force_n);
            if (k % 20 == 19) { EXPECT_EQ(count_in_ball(prepared.model, simulator.state()), 0U) << "step " << k; }
        }
        met += highest > 1e-3;
        EXPECT_LT(highest, 50.0) << "N";
    }
    EXPECT_GE(met, 3U) << "some of them met the ball";
}

/// A solid that nothing reaches moves to the bits of a scene without the space around it.
TEST(AroundSolids, WhatIsNotReachedMovesAsWithout) {
    std::string with = needle_scene({.depth = 20.0});
    const auto replace = [&](std::string text, const std::string& what, const std::string& by) {
        const std::size_t at = text.find(what);
        EXPECT_NE(at, std::string::npos) << what;
        return at == std::string::npos ? text : text.replace(at, what.size(), by);
    };
    with = replace(with, "\"effects\": [", "\"gravity\": [0, -9810, 0], \"effects\": [\"gravity\", ");
    const std::string without = replace(with, R"({"around": ["ball"], "margin": 50})", R"({"shape": "box", "centre": [0, 0, 0], "extent": [160, 160, 160], "cells": 4})");
    const PreparedScene a = test::prepare(with), b = test::prepare(without);
    Simulator one(a.model), two(b.model);
    for (int k = 0; k < 100; ++k) {
        ASSERT_TRUE(one.step().finite && two.step().finite);
        ASSERT_EQ(one.state().bodies[0].tissue.position, two.state().bodies[0].tissue.position) << "step " << k;
    }
    EXPECT_GT((one.state().bodies[0].surface[0] - a.model.bodies[0].surface.vertices[0]).norm(), 1e-5) << "m: it hangs";
}

/// A state that goes on from a copy goes on to the same bits, forces included.
TEST(AroundSolids, AForkGoesOnToTheSameBits) {
    const PreparedScene prepared = test::prepare(needle_scene({}));
    Simulator simulator(prepared.model);
    for (int k = 0; k < 200; ++k) ASSERT_TRUE(simulator.step().finite);
    Simulator fork = simulator.fork();
    for (int k = 0; k < 50; ++k) ASSERT_TRUE(simulator.step().finite && fork.step().finite);
    EXPECT_EQ(hash_state(simulator.state()), hash_state(fork.state()));
    EXPECT_EQ(simulator.report().handle_force_n, fork.report().handle_force_n);
}

/// Several solids, those that rest and one that deforms, in any order.
TEST(AroundSolids, AWallOfSeveralSolidsFollowsTheOneThatDeforms) {
    const std::string ball = R"({"kind": "deformable", "surface": {"shape": "sphere", "centre": [0, 0, 0], "radius": 30, "subdivisions": 3},
        "coarse": {"mesher": "lattice", "surface_triangles": 400}, "fixed": [{"direction": [0, 0, -1], "fraction": 0.3}]})";
    const std::string table = R"({"kind": "static", "surface": {"shape": "box", "centre": [0, 0, -50], "extent": [100, 100, 10], "cells": 2}})";
    const std::string post = R"({"kind": "static", "surface": {"shape": "sphere", "centre": [60, 0, 0], "radius": 10, "subdivisions": 2}})";
    const std::string text = fmt::format(R"({{"name": "several", "units": {{"length": "mm", "pressure": "kPa"}}, "time": {{"step": 0.01, "duration": 1}}, "budget": "exact",
        "gravity": [0, 0, -9810],
        "bodies": {{"table": {}, "ball": {}, "post": {}, "space": {{"kind": "static", "hollow": true, "surface": {{"around": ["post", "ball", "table"]}}}}}},
        "effects": ["elasticity", "gravity", "coarse_contact"]}})", table, ball, post);
    const PreparedScene prepared = test::prepare(text);
    ASSERT_EQ(prepared.model.bodies.size(), 4U);
    const BodyModel &space = prepared.model.bodies[3], &deforms = prepared.model.bodies[1];
    ASSERT_EQ(space.host_body, std::size_t{1});
    const std::size_t first = prepared.model.bodies[2].surface.vertices.size();
    Simulator simulator(prepared.model);
    for (int k = 0; k < 30; ++k) ASSERT_TRUE(simulator.step().finite);
    const std::vector<Vec3>& wall = simulator.state().bodies[3].surface;
    for (std::size_t v = 0; v < deforms.surface.vertices.size(); ++v) ASSERT_EQ(wall[first + v], simulator.state().bodies[1].surface[v]);
    const TriMesh& rest = space.surface;
    EXPECT_GT(signed_volume(rest), 0.0);
    Box3 box;
    for (const Vec3& v : rest.vertices) box.add(v);
    EXPECT_NEAR(box.hi.x(), 0.07 + 0.05, 1e-12) << "m: 50 mm where no margin is given";
    EXPECT_NEAR(box.lo.z(), -0.055 - 0.05, 1e-12);
}

struct Refused {
    std::string space, words;
};

TEST(AroundSolids, MistakesAreRefusedWithTheKeyAndWhatWasExpected) {
    const std::string bodies = R"("ball": {"kind": "deformable", "surface": {"shape": "sphere", "centre": [0, 0, 0], "radius": 30, "subdivisions": 2}},
        "other": {"kind": "deformable", "surface": {"shape": "sphere", "centre": [80, 0, 0], "radius": 30, "subdivisions": 2}},
        "mover": {"kind": "kinematic", "surface": {"shape": "sphere", "centre": [0, 80, 0], "radius": 10, "subdivisions": 2}, "motion": [[0, 0, 0, 0]]},
        "tube": {"kind": "static", "hollow": true, "surface": {"shape": "sphere", "centre": [0, 0, 0], "radius": 90, "subdivisions": 2}})";
    const auto parse = [&](const std::string& space) {
        return parse_scene(fmt::format(R"({{"name": "refused", "units": {{"length": "mm", "pressure": "kPa"}}, "time": {{"step": 0.01, "duration": 1}},
            "bodies": {{{}, "space": {{{}}}, "late": {{"kind": "static", "surface": {{"shape": "box", "centre": [0, 0, 0], "extent": [1, 1, 1]}}}}}}}})", bodies, space),
                           "scenes/refused.json");
    };
    const std::string hollow = R"("kind": "static", "hollow": true, )";
    EXPECT_TRUE(parse(hollow + R"("surface": {"around": ["ball"]})").ok());
    for (const Refused& refused : {
             Refused{hollow + R"("surface": {"around": ["bal"]})", "ball"},
             {hollow + R"("surface": {"around": []})", "around"},
             {hollow + R"("surface": {"around": ["late"]})", "before"},
             {hollow + R"("surface": {"around": ["space"]})", "before"},
             {hollow + R"("surface": {"around": ["tube"]})", "hollow"},
             {hollow + R"("surface": {"around": ["mover"]})", "moves as told"},
             {hollow + R"("surface": {"around": ["ball", "other"]})", "both deform"},
             {hollow + R"("surface": {"around": ["ball", "ball"]})", "twice"},
             {hollow + R"("surface": {"around": ["ball"], "margin": -1})", "margin"},
             {hollow + R"("surface": {"around": ["ball"], "margins": 1})", "margin"},
             {hollow + R"("surface": {"around": ["ball"]}, "embedded_in": "ball")", "embedded_in"},
             {hollow + R"("surface": {"around": ["ball"]}, "scale": 2)", "scale"},
             {hollow + R"("surface": {"around": "ball"})", "around"},
             {R"("kind": "static", "surface": {"around": ["ball"]})", "hollow"},
             {R"("kind": "deformable", "hollow": true, "surface": {"around": ["ball"]})", "static"}}) {
        const Result<Scene> scene = parse(refused.space);
        ASSERT_FALSE(scene.ok()) << refused.space;
        EXPECT_NE(scene.error().to_string().find(refused.words), std::string::npos) << refused.space << "\n" << scene.error().to_string();
        EXPECT_NE(scene.error().to_string().find("refused.json:"), std::string::npos) << scene.error().to_string();
    }
}

} // namespace
} // namespace trocar::engine
