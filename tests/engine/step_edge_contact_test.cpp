// Edges that cross edges, with no vertex near: what must hold whatever the orientation, step length and budget.
#include "base/inside.hpp"
#include "engine/io/write_mesh.hpp"
#include "engine/step/checkpoint.hpp"
#include "fem/tissue/integrate.hpp"
#include "step_fixture.hpp"

#include <Eigen/Geometry>

#include <unistd.h>

namespace trocar::engine {
namespace {

constexpr unsigned kEdgeSeed = 20262;

/// A bar with corners at its ends alone. m
struct EdgeBar {
    Vec3 centre = Vec3::Zero(), extent = Vec3(0.1, 0.02, 0.02);
    Mat3 turn = Mat3::Identity();
};

TriMesh make_bar(const EdgeBar& bar) {
    TriMesh mesh;
    for (int k = 0; k < 8; ++k) {
        const Vec3 corner((k & 1) ? 0.5 : -0.5, (k & 2) ? 0.5 : -0.5, (k & 4) ? 0.5 : -0.5);
        mesh.vertices.push_back(bar.centre + bar.turn * corner.cwiseProduct(bar.extent));
    }
    for (const Triangle& t : {Triangle{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4}, {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6},
                              {1, 3, 5}, {3, 7, 5}})
        mesh.triangles.push_back(t);
    return mesh;
}

std::string bar_file(const std::string& name, const EdgeBar& bar) {
    const std::filesystem::path file = std::filesystem::path(testing::TempDir()) /
        fmt::format("{}_{}_{}.obj", testing::UnitTest::GetInstance()->current_test_info()->name(), getpid(), name);
    EXPECT_TRUE(write_obj(file, make_bar(bar)).ok());
    return file.string();
}

std::string soft_bar(const std::string& name, const EdgeBar& bar, double kpa, double damping, const std::string& mesher = "lattice") {
    return fmt::format(R"("{}": {{"kind": "deformable", "surface": "{}", "material": {{"young_modulus": {}, "poisson_ratio": 0.3,
        "density": 1000, "viscosity": {}, "mass_damping": {}}}, "coarse": {{"mesher": "{}", "surface_triangles": 300}}}})",
                       name, bar_file(name, bar), kpa, damping > 0.0 ? 0.1 : 0.0, damping, mesher);
}

/// A body's text with a velocity, m/s.
std::string thrown(std::string body, const Vec3& velocity) {
    return body.insert(body.size() - 1, fmt::format(R"(, "velocity": [{}, {}, {}])", velocity.x(), velocity.y(), velocity.z()));
}

std::string fixed_bar(const std::string& name, const EdgeBar& bar) {
    return fmt::format(R"("{}": {{"kind": "static", "surface": "{}"}})", name, bar_file(name, bar));
}

PreparedScene prepare_bars(const std::string& bodies, double step, const Vec3& gravity, const std::string& budget = "exact", const std::string& trees = "covering",
                           const std::string& integrator = "rk4") {
    return test::prepare(fmt::format(R"({{"units": {{"length": "m", "pressure": "kPa"}}, "time": {{"step": {}, "duration": 10, "integrator": "{}"}}, "budget": "{}",
        "gravity": [{}, {}, {}], "bodies": {{{}}}, "contact": {{"sphere_trees": "{}"}},
        "effects": ["elasticity", "gravity", "damping", "coarse_contact"]}})",
                                     step, integrator, budget, gravity.x(), gravity.y(), gravity.z(), bodies, trees));
}

Mat3 about(const Vec3& axis, double angle) { return Eigen::AngleAxisd(angle, axis).toRotationMatrix(); }

constexpr double kEighth = 0.25 * 3.14159265358979;

/// A bar lies flat across the ridges of two rails that do not give. world   turns all of it
struct Rails {
    Mat3 world = Mat3::Identity();
    double heading = 0.0; // rad, of the bar against the normal to the rails
    double drop = 0.2e-3; // m
};

std::string rails_of(const Rails& rails, const std::string& mesher) {
    const double half = 0.02 / std::sqrt(2.0); // of the rails, from the middle to the ridge
    const Mat3 on_edge = about(Vec3::UnitX(), kEighth);
    const EdgeBar left{rails.world * Vec3(0.0, -0.03, -half), {0.3, 0.02, 0.02}, rails.world * on_edge};
    const EdgeBar right{rails.world * Vec3(0.0, 0.03, -half), {0.3, 0.02, 0.02}, rails.world * on_edge};
    const EdgeBar over{rails.world * Vec3(0.004, 0.003, 0.01 + rails.drop), {0.02, 0.1, 0.02}, rails.world * about(Vec3::UnitZ(), rails.heading)};
    return soft_bar("over", over, 500.0, 5.0, mesher) + ", " + fixed_bar("left", left) + ", " + fixed_bar("right", right);
}

TEST(EdgeContact, ABarAcrossTwoRailsIsCarriedByThemAndByNothingElse) {
    test::Random random(kEdgeSeed);
    for (int k = 0; k < 6; ++k) {
        const Rails rails{.world = random.turn(), .heading = random.between(-0.6, 0.6)};
        const double step = std::vector{0.001, 0.005, 0.01}[k % 3];
        const std::string mesher = k < 3 ? "lattice" : "tetgen", trees = k == 1 || k == 5 ? "wrapped" : "covering";
        SCOPED_TRACE(fmt::format("seed {} case {}: heading {:g}, step {:g} s, {}, {} trees", kEdgeSeed, k, rails.heading, step, mesher, trees));
        const Vec3 up = rails.world.col(2);
        const PreparedScene prepared = prepare_bars(rails_of(rails, mesher), step, -9.81 * up, "exact", trees);
        ASSERT_EQ(prepared.model.bodies.size(), 3u);
        const double weight = 9.81 * prepared.model.bodies[0].tissue->mass;
        Simulator simulator(prepared.model);
        const auto run = [&](double seconds, auto&& look) {
            for (int n = 0; n < static_cast<int>(seconds / step + 0.5); ++n) {
                const StepReport& report = simulator.step();
                ASSERT_TRUE(report.finite) << report.failure;
                look(report);
            }
        };
        double deepest = 0.0, sum = 0.0, sum_sq = 0.0, aside = 0.0, count = 0.0;
        ASSERT_NO_FATAL_FAILURE(run(1.5, [](const StepReport&) {}));
        ASSERT_NO_FATAL_FAILURE(run(0.3, [&](const StepReport& report) {
            Vec3 force = Vec3::Zero();
            for (const SolidContact& place : simulator.state().solids.contacts)
                force += (place.touch.a == Thing::body(0) ? 1.0 : -1.0) * place.touch.force;
            sum += force.dot(up), sum_sq += std::pow(force.dot(up), 2), ++count;
            aside = std::max(aside, (force - force.dot(up) * up).norm());
            deepest = std::max(deepest, report.deepest_touch_m);
        }));
        const double mean = sum / count;
        EXPECT_NEAR(mean, weight, 0.01 * weight);
        EXPECT_LT(std::sqrt(std::max(0.0, sum_sq / count - mean * mean)), 0.02 * weight);
        EXPECT_LT(aside, 2e-3 * weight) << "ridges without friction hold nothing sideways";
        EXPECT_LT(deepest, 0.06e-3);
    }
}

/// Two bars across each other, edge towards edge; the common normal of the edges is `normal`, from the second to the first.
struct Crossing {
    EdgeBar first, second;
    Vec3 normal;
};

Crossing make_crossing(const Mat3& world, double angle, double gap) {
    const double half = 0.02 / std::sqrt(2.0);
    const Mat3 on_edge = about(Vec3::UnitX(), kEighth);
    Crossing made;
    made.normal = world.col(2);
    made.second = {world * Vec3(0.0, 0.0, -half), {0.1, 0.02, 0.02}, world * on_edge};
    made.first = {world * Vec3(0.0, 0.0, half + gap), {0.1, 0.02, 0.02}, world * about(Vec3::UnitZ(), angle) * on_edge};
    return made;
}

Vec3 middle_of(const SceneModel& model, const State& state, std::size_t body) {
    Vec3 sum = Vec3::Zero();
    const fem::TissueModel& tissue = *model.bodies[body].tissue;
    for (std::size_t n = 0; n < tissue.node_count(); ++n) sum += tissue.node_mass[n] * state.bodies[body].tissue.position[n];
    return sum / tissue.mass;
}

TEST(EdgeContact, BarsThatFlyEdgeOnEdgeDoNotPassAndKeepTheirMomentum) {
    test::Random random(kEdgeSeed);
    for (int k = 0; k < 10; ++k) {
        const double speed = std::pow(10.0, random.between(-1.0, 1.3)), step = std::pow(10.0, random.between(-3.3, -2.3));
        const Mat3 world = random.turn();
        const double angle = random.between(0.6, 2.5), gap = random.between(0.5e-3, 5e-3);
        const Crossing bars = make_crossing(world, angle, gap);
        SCOPED_TRACE(fmt::format("seed {} case {}: {:g} m/s, step {:g} s, {:g} rad, {:g} m apart", kEdgeSeed, k, speed, step, angle, gap));
        std::string first = soft_bar("first", bars.first, 30000.0, 0.0);
        const Vec3 velocity = -speed * bars.normal;
        if (k % 2 == 0) first = thrown(first, velocity);
        const PreparedScene prepared = prepare_bars(first + ", " + soft_bar("second", bars.second, 30000.0, 0.0), step, Vec3::Zero());
        ASSERT_EQ(prepared.model.bodies.size(), 2u);
        Simulator simulator(prepared.model);
        if (k % 2) { // a state from elsewhere: its first step knows of nothing
            State thrown = simulator.state();
            for (Vec3& v : thrown.bodies[0].tissue.velocity) v = -speed * bars.normal;
            ASSERT_TRUE(simulator.restore(thrown).ok());
        }
        const fem::TissueModel& tissue = *prepared.model.bodies[0].tissue;
        for (int n = 0; n < static_cast<int>(0.03 / speed / step) + 20; ++n) {
            const StepReport& report = simulator.step();
            ASSERT_TRUE(report.finite) << report.failure;
            const Vec3 apart = middle_of(prepared.model, simulator.state(), 0) - middle_of(prepared.model, simulator.state(), 1);
            ASSERT_GT(apart.dot(bars.normal), 0.0) << "passed in step " << n;
        }
        const Vec3 still = fem::find_momentum(tissue, simulator.state().bodies[0].tissue).linear;
        EXPECT_LT(-still.dot(bars.normal), 0.7 * tissue.mass * speed) << "they have met";
        Vec3 left = tissue.mass * speed * bars.normal;
        for (std::size_t i : {0u, 1u})
            left += fem::find_momentum(*prepared.model.bodies[i].tissue, simulator.state().bodies[i].tissue).linear;
        EXPECT_LT(left.norm(), 1e-9 * tissue.mass * speed);
    }
}

/// m; by how much two convex polyhedra overlap along the direction that parts them best: negative where they are apart. Brute force.
double overlap_of(const std::vector<Vec3>& a, const std::vector<Vec3>& b, const TriMesh& mesh) {
    double least = std::numeric_limits<double>::infinity();
    const auto look = [&](const Vec3& way) {
        if (!(way.norm() > 1e-9)) return;
        const Vec3 n = way.normalized();
        double low_a = 1e9, high_a = -1e9, low_b = 1e9, high_b = -1e9;
        for (const Vec3& p : a) low_a = std::min(low_a, n.dot(p)), high_a = std::max(high_a, n.dot(p));
        for (const Vec3& p : b) low_b = std::min(low_b, n.dot(p)), high_b = std::max(high_b, n.dot(p));
        least = std::min({least, high_a - low_b, high_b - low_a});
    };
    std::vector<Vec3> along[2];
    for (const int which : {0, 1})
        for (const Triangle& t : mesh.triangles) {
            const std::vector<Vec3>& at = which ? b : a;
            look((at[t[1]] - at[t[0]]).cross(at[t[2]] - at[t[0]]));
            for (int c = 0; c < 3; ++c) along[which].push_back(at[t[(c + 1) % 3]] - at[t[c]]);
        }
    for (const Vec3& e : along[0])
        for (const Vec3& f : along[1])
            if (e.cross(f).norm() > 0.02 * e.norm() * f.norm()) look(e.cross(f));
    return least;
}

TEST(EdgeContact, BlocksThatTumbleOntoOneAnotherOverlapNoMoreThanByBruteForceIsAllowed) {
    test::Random random(kEdgeSeed);
    for (int k = 0; k < 8; ++k) {
        const double step = std::vector{0.0005, 0.002, 0.005, 0.01}[k % 4];
        SCOPED_TRACE(fmt::format("seed {} case {}: step {:g} s", kEdgeSeed, k, step));
        const EdgeBar fixed{Vec3::Zero(), {random.between(0.03, 0.08), random.between(0.02, 0.05), random.between(0.02, 0.05)}, random.turn()};
        EdgeBar falling{Vec3::Zero(), {random.between(0.02, 0.06), random.between(0.02, 0.04), random.between(0.02, 0.04)}, random.turn()};
        const double low = -0.5 * (fixed.extent.norm() + falling.extent.norm());
        falling.centre = Vec3(random.between(-8e-3, 8e-3), random.between(-8e-3, 8e-3), -low);
        const PreparedScene prepared =
            prepare_bars(soft_bar("falling", falling, 1000.0, 1.0, "tetgen") + ", " + fixed_bar("fixed", fixed), step, Vec3(0.0, 0.0, -9.81));
        ASSERT_EQ(prepared.model.bodies.size(), 2u);
        const TriMesh box = make_bar({});
        Simulator simulator(prepared.model);
        double deepest = 0.0;
        std::uint64_t touches = 0;
        for (int n = 0; n < static_cast<int>(0.6 / step); ++n) {
            const StepReport& report = simulator.step();
            ASSERT_TRUE(report.finite) << report.failure;
            touches += report.solid_touches;
            deepest = std::max(deepest, overlap_of(simulator.state().bodies[0].surface, simulator.state().bodies[1].surface, box));
        }
        EXPECT_GT(touches, 0u);
        EXPECT_LT(deepest, 0.6e-3) << "what a vertex goes in while it strikes; edges that are not seen cross by 8 mm";
    }
}

TEST(EdgeContact, ASharpTipThatFallsOnItsSideIsMetBeforeItIsIn) {
    test::Random random(kEdgeSeed);
    for (int k = 0; k < 4; ++k) {
        const double step = std::vector{0.001, 0.002, 0.005, 0.01}[k];
        SCOPED_TRACE(fmt::format("seed {} case {}: step {:g} s", kEdgeSeed, k, step));
        TriMesh tip; // its corner lies lowest, and looks along -x
        const double height = random.between(1e-3, 4e-3);
        tip.vertices = {{0.0, 0.0, height}, {0.04, -0.006, 0.005 + height}, {0.04, 0.008, 0.004 + height}, {0.04, 0.001, 0.02 + height}};
        tip.triangles = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};
        const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / fmt::format("tip_{}.obj", getpid());
        ASSERT_TRUE(write_obj(file, tip).ok());
        const std::string body = fmt::format(R"("tip": {{"kind": "deformable", "surface": "{}", "velocity": [0, 0, -1],
            "material": {{"young_modulus": 500, "density": 1000}}, "coarse": {{"mesher": "tetgen", "surface_triangles": 200}}}},
            "table": {{"kind": "static", "surface": {{"shape": "box", "centre": [0, 0, -0.01], "extent": [0.3, 0.3, 0.02], "cells": 3}}}})",
                                             file.string());
        const PreparedScene prepared = prepare_bars(body, step, Vec3(0.0, 0.0, -9.81));
        ASSERT_EQ(prepared.model.bodies.size(), 2u);
        Simulator simulator(prepared.model);
        double lowest = 1.0;
        for (int n = 0; n < static_cast<int>(0.05 / step); ++n) {
            ASSERT_TRUE(simulator.step().finite) << simulator.report().failure;
            for (const Vec3& v : simulator.state().bodies[0].surface) lowest = std::min(lowest, v.z());
        }
        EXPECT_LT(lowest, 2e-3) << "it fell";
        EXPECT_GT(lowest, -0.6e-3);
    }
}

/// m; by how much a place lies in a box.
double depth_in_box(const EdgeBar& box, const Vec3& place) {
    return (0.5 * box.extent - (box.turn.transpose() * (place - box.centre)).cwiseAbs()).minCoeff();
}

/// A tip that comes from beside a box and goes in by its top: nearest to it before is a side that it passes by.
TEST(TipContact, WhatComesRoundAnEdgeIsMetByTheFaceThatItGoesInBy) {
    test::Random random(kEdgeSeed);
    int beside = 0;
    for (int k = 0; k < 24; ++k) {
        const EdgeBar box{Vec3::Zero(), {0.08, 0.08, 0.06}, random.turn()};
        const double speed = random.between(0.5, 3.0), step = std::pow(10.0, random.between(-2.7, -2.0));
        const Vec3 entry(0.04 - random.between(0.002, 0.01), random.between(-0.02, 0.02), 0.03);
        const Vec3 way = Vec3(-random.between(0.6, 1.5), random.between(-0.3, 0.3), -random.between(0.15, 0.4)).normalized(); // of the box's own axes
        const double ahead = random.between(0.5, 0.95) * speed * step; // it comes in within the first step
        SCOPED_TRACE(fmt::format("seed {} case {}: {:g} m/s, step {:g} s, {:g} m ahead", kEdgeSeed, k, speed, step, ahead));
        const Vec3 start = entry - ahead * way;
        beside += start.x() > 0.04;
        TriMesh tip; // its axis along the way, its corner ahead
        const Vec3 across = way.cross(Vec3::UnitY()).normalized(), other = way.cross(across);
        tip.vertices = {start, start - 0.03 * way + 0.009 * across, start - 0.03 * way + 0.009 * (-0.5 * across + 0.87 * other),
                        start - 0.03 * way + 0.009 * (-0.5 * across - 0.87 * other)};
        for (Vec3& v : tip.vertices) v = box.turn * v;
        tip.triangles = {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}};
        const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / fmt::format("coming_{}.obj", getpid());
        ASSERT_TRUE(write_obj(file, tip).ok());
        const Vec3 velocity = box.turn * (speed * way);
        const PreparedScene prepared = prepare_bars(fmt::format(R"("tip": {{"kind": "deformable", "surface": "{}", "velocity": [{}, {}, {}],
            "material": {{"young_modulus": 2000, "density": 1000}}, "coarse": {{"mesher": "tetgen", "surface_triangles": 100}}}}, )",
                                                                file.string(), velocity.x(), velocity.y(), velocity.z()) +
                                                        fixed_bar("box", box),
                                                    step, Vec3::Zero());
        ASSERT_EQ(prepared.model.bodies.size(), 2u);
        Simulator simulator(prepared.model);
        ASSERT_TRUE(simulator.step().finite) << simulator.report().failure;
        EXPECT_LT(depth_in_box(box, simulator.state().bodies[0].surface[0]), 0.1e-3);
        EXPECT_LT((box.turn.transpose() * simulator.state().bodies[0].surface[0]).x(), 0.04) << "it was held by what it passes by";
    }
    EXPECT_GT(beside, 8) << "it starts where the side of the box is nearest";
}

/// What touches nothing goes as if it were alone, to the bit, however near it flies past.
TEST(TipContact, WhatFliesPastIsHeldByNothing) {
    test::Random random(kEdgeSeed);
    for (int k = 0; k < 24; ++k) {
        const EdgeBar box{Vec3::Zero(), {0.08, 0.08, 0.03}, random.turn()};
        const double speed = random.between(0.3, 3.0), step = std::pow(10.0, random.between(-2.7, -2.0)), above = random.between(0.4e-3, 3e-3);
        const bool moves = k % 3 == 0; // the box does, against it
        SCOPED_TRACE(fmt::format("seed {} case {}: {:g} m/s, step {:g} s, {:g} m above", kEdgeSeed, k, speed, step, above));
        EdgeBar flying{Vec3::Zero(), {random.between(0.01, 0.03), random.between(0.01, 0.03), random.between(0.01, 0.03)}, random.turn()};
        double low = 0.0, front = 0.0;
        for (const Vec3& v : make_bar(flying).vertices) low = std::min(low, v.z()), front = std::max(front, v.x());
        flying.centre = box.turn * Vec3(-0.04 - front - random.between(0.002, 0.02), random.between(-0.02, 0.02), 0.015 + above - low);
        flying.turn = box.turn * flying.turn;
        const Vec3 velocity = box.turn * Vec3(speed, 0.0, 0.0), against = moves ? Vec3(-0.7 * velocity) : Vec3::Zero();
        const std::string body = thrown(soft_bar("flying", flying, 500.0, 0.0), velocity);
        const std::string other = moves ? thrown(soft_bar("box", box, 500.0, 0.0), against) : fixed_bar("box", box);
        const PreparedScene both = prepare_bars(body + ", " + other, step, Vec3::Zero()), alone = prepare_bars(body, step, Vec3::Zero());
        ASSERT_EQ(both.model.bodies.size(), 2u);
        Simulator simulator(both.model), free(alone.model);
        for (int n = 0; n < static_cast<int>(0.16 / (speed * (moves ? 1.7 : 1.0)) / step) + 2; ++n) {
            ASSERT_TRUE(simulator.step().finite) << simulator.report().failure;
            ASSERT_TRUE(free.step().finite);
            ASSERT_EQ(simulator.state().bodies[0].tissue.position, free.state().bodies[0].tissue.position) << "step " << n;
        }
    }
}

/// The rim of a table looks aside, and no block that slides over it or along it runs into it: not into the vertices by which it is divided either, and though
/// each step expects the block to sink by what it falls in one.
TEST(TipContact, ABlockThatSlidesOverARimIsNotHeldByIt) {
    test::Random random(kEdgeSeed);
    for (int k = 0; k < 80; ++k) {
        const bool along = k % 4 != 0; // the rim beneath it, else towards that
        const int cells = static_cast<int>(random.between(1.0, 12.0));
        const double step = std::pow(10.0, random.between(-2.7, -2.0)), speed = random.between(0.2, 1.5), y = random.between(0.136, 0.147);
        const char* integrator = random.coin() ? "rk4" : "leapfrog";
        SCOPED_TRACE(fmt::format("seed {} case {}: {} cells, step {:g} s, {:g} m/s {} at {:g} m, {}", kEdgeSeed, k, cells, step, speed, along ? "along" : "towards",
                                 y, integrator));
        const EdgeBar block{along ? Vec3(-0.1, y, 0.0151) : Vec3(0.04, y - 0.14, 0.0151), {0.03, 0.03, 0.03}, Mat3::Identity()};
        const std::string table = fmt::format(
            R"("table": {{"kind": "static", "surface": {{"shape": "box", "centre": [0, 0, -0.01], "extent": [0.3, 0.3, 0.02], "cells": {}}}}})", cells);
        const PreparedScene prepared = prepare_bars(thrown(soft_bar("block", block, 500.0, 0.0), Vec3(speed, 0.0, 0.0)) + ", " + table, step, Vec3(0.0, 0.0, -9.81),
                                                    "exact", "covering", integrator);
        ASSERT_EQ(prepared.model.bodies.size(), 2u);
        Simulator simulator(prepared.model);
        const Vec3 from = middle_of(prepared.model, simulator.state(), 0);
        const int steps = static_cast<int>(0.1 / speed / step) + 1;
        for (int n = 0; n < steps; ++n) ASSERT_TRUE(simulator.step().finite) << simulator.report().failure;
        const Vec3 way = middle_of(prepared.model, simulator.state(), 0) - from;
        EXPECT_NEAR(way.x() / (speed * step * steps), 1.0, 0.005);
        EXPECT_LT(way.z(), 0.5e-3) << "it was thrown up";
        EXPECT_GT(way.z(), -1e-3) << "it sank, or tipped over";
    }
}

/// Bars without any damping that strike and graze one another fast, turning: also afterwards, while what rings in them has nothing to end it.
TEST(TipContact, WhatStrikesFastKeepsMomentumAndAngularMomentum) {
    test::Random random(kEdgeSeed);
    int struck = 0;
    for (int k = 0; k < 20; ++k) {
        const double speed = random.between(1.0, 4.0), step = std::pow(10.0, random.between(-2.7, -2.0));
        SCOPED_TRACE(fmt::format("seed {} case {}: {:g} m/s, step {:g} s", kEdgeSeed, k, speed, step));
        const EdgeBar first{Vec3::Zero(), {0.06, 0.03, 0.02}, random.turn()};
        const Vec3 towards = random.direction();
        const EdgeBar second{(0.08 + speed * step) * towards + 0.012 * random.direction(), {0.05, 0.02, 0.02}, random.turn()};
        const PreparedScene prepared = prepare_bars(soft_bar("first", first, 500.0, 0.0) + ", " + soft_bar("second", second, 500.0, 0.0), step, Vec3::Zero(),
                                                    "exact", "covering", "leapfrog"); // which keeps a body's own
        ASSERT_EQ(prepared.model.bodies.size(), 2u);
        Simulator simulator(prepared.model);
        State start = simulator.state();
        const Vec3 spin = 20.0 * random.direction();
        for (std::size_t n = 0; n < start.bodies[1].tissue.velocity.size(); ++n)
            start.bodies[1].tissue.velocity[n] = -speed * towards + spin.cross(start.bodies[1].tissue.position[n] - second.centre);
        ASSERT_TRUE(simulator.restore(start).ok());
        const auto momentum = [&](const State& state) {
            fem::Momentum sum;
            for (const std::size_t i : {0u, 1u}) {
                const fem::Momentum own = fem::find_momentum(*prepared.model.bodies[i].tissue, state.bodies[i].tissue);
                sum.linear += own.linear, sum.angular += own.angular;
            }
            return sum;
        };
        const fem::Momentum before = momentum(start);
        for (int n = 0; n < static_cast<int>(0.12 / speed / step) + 30; ++n) ASSERT_TRUE(simulator.step().finite) << simulator.report().failure;
        const fem::Momentum after = momentum(simulator.state());
        const double scale = prepared.model.bodies[1].tissue->mass * speed;
        EXPECT_LT((after.linear - before.linear).norm(), 1e-9 * scale);
        EXPECT_LT((after.angular - before.angular).norm(), 1e-9 * 0.1 * scale);
        struck += fem::find_momentum(*prepared.model.bodies[0].tissue, simulator.state().bodies[0].tissue).linear.norm() > 0.01 * scale;
    }
    EXPECT_GT(struck, 10);
}

/// Blocks of 12 corners, of which a coarse lattice reaches none, that fall onto one another and onto a table, turned at random.
TEST(SharpCorners, OfBlocksThatFellLieInNothing) {
    test::Random random(kEdgeSeed);
    for (int k = 0; k < 6; ++k) {
        const double step = std::vector{0.001, 0.005, 0.01}[k % 3];
        SCOPED_TRACE(fmt::format("seed {} case {}: step {:g} s", kEdgeSeed, k, step));
        std::string bodies;
        std::vector<EdgeBar> blocks;
        for (double z = 0.03; blocks.size() < 3; z += 0.045) {
            blocks.push_back({Vec3(random.between(-0.008, 0.008), random.between(-0.008, 0.008), z),
                              {random.between(0.015, 0.03), random.between(0.015, 0.03), random.between(0.015, 0.03)}, random.turn()});
            bodies += soft_bar(fmt::format("block{}", blocks.size()), blocks.back(), 100.0, 0.02) + ", ";
        }
        const PreparedScene prepared = prepare_bars(
            bodies + R"("table": {"kind": "static", "surface": {"shape": "box", "centre": [0, 0, -0.01], "extent": [0.4, 0.4, 0.02], "cells": 4}})", step,
            Vec3(0.0, 0.0, -9.81));
        ASSERT_EQ(prepared.model.bodies.size(), 4u);
        Simulator simulator(prepared.model);
        for (int n = 0; n < static_cast<int>(0.8 / step); ++n) ASSERT_TRUE(simulator.step().finite) << simulator.report().failure;
        const State& state = simulator.state();
        for (std::size_t own = 0; own < 3; ++own)
            for (std::size_t other = 0; other < 4; ++other) {
                if (own == other) continue;
                const InsideTest there(TriMesh{state.bodies[other].surface, prepared.model.bodies[other].surface.triangles});
                for (const Vec3& v : state.bodies[own].surface) EXPECT_GT(there.signed_distance(v), -0.5e-3) << own << " in " << other;
            }
    }
}

TEST(EdgeContact, ABudgetOfAnySizeLetsNoBarThroughTheRails) {
    test::Random random(kEdgeSeed);
    for (const char* budget : {"work:0", "work:10", "work:30", "work:100", "work:300", "work:1000", "work:3000"}) {
        const Rails rails{.world = random.turn(), .heading = random.between(-0.6, 0.6), .drop = random.between(0.5e-3, 5e-3)};
        const double step = random.step();
        const std::string mesher = random.coin() ? "lattice" : "tetgen";
        SCOPED_TRACE(fmt::format("seed {}: {}, heading {:g}, step {:g} s, {}", kEdgeSeed, budget, rails.heading, step, mesher));
        const Vec3 up = rails.world.col(2);
        const PreparedScene prepared = prepare_bars(rails_of(rails, mesher), step, -9.81 * up, budget);
        ASSERT_EQ(prepared.model.bodies.size(), 3u);
        Simulator simulator(prepared.model);
        for (int n = 0; n < static_cast<int>(0.5 / step); ++n) {
            ASSERT_TRUE(simulator.step().finite) << simulator.report().failure;
            ASSERT_GT(middle_of(prepared.model, simulator.state(), 0).dot(up), 8e-3) << "step " << n;
        }
    }
}

TEST(EdgeContact, AStateInWhichEdgesPressIsSavedAndGoesOnToTheSameBits) {
    const PreparedScene prepared = prepare_bars(rails_of({.heading = -0.3}, "lattice"), 0.005, Vec3(0.0, 0.0, -9.81));
    ASSERT_EQ(prepared.model.bodies.size(), 3u);
    Simulator simulator(prepared.model);
    for (int n = 0; n < 60; ++n) simulator.step();
    const auto& contacts = simulator.state().solids.contacts;
    ASSERT_TRUE(std::any_of(contacts.begin(), contacts.end(), [](const SolidContact& c) { return c.touch.between_edges(); }));
    const Result<Checkpoint> read = parse_checkpoint(checkpoint_bytes(make_checkpoint(simulator)), "edges.ckpt");
    ASSERT_TRUE(read.ok()) << read.error().to_string();
    Simulator other(prepared.model);
    ASSERT_TRUE(resume(other, *read, "edges.ckpt").ok());
    for (int n = 0; n < 20; ++n) {
        simulator.step(), other.step();
        ASSERT_EQ(simulator.hash(), other.hash()) << "step " << n;
    }
}

} // namespace
} // namespace trocar::engine
