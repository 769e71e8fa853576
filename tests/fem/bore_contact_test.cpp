// A rod with play in the bore of another one: laws over random pairs, step lengths and drives, with and without torsion and friction.
#include "fem/rod/bore_contact.hpp"
#include "tests/fem/rods_of_a_test.hpp"

#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <random>

namespace trocar::fem {
namespace {

struct WireInTube {
    RodsOfATest rods;
    RodAlone *outer = nullptr, *inner = nullptr;
};
void put_in_bore(WireInTube& pair, double play) { pair.inner->inside = 0, pair.inner->play = play; }

RodDesign plain_rod(double length, double radius, double segment, double modulus, bool torsion) {
    RodDesign design;
    design.length = length, design.radius = radius, design.segment = segment, design.young_modulus = modulus;
    design.tip = TipShape::Straight, design.torsion = torsion;
    return design;
}

/// How far the nodes of the inner rod in the bore, but for one segment behind the mouth, are from the outer one's curve, plays.
double farthest(const WireInTube& pair) {
    const RodModel& in = pair.inner->model;
    double most = 0.0;
    for (Index i = first_inserted_node(in, pair.inner->state.insertion); i < in.node_count(); ++i)
        if (arc_of(in, pair.inner->state.insertion, i) < pair.outer->state.insertion - in.segment)
            most = std::max(most, distance_to_curve(pair.outer->state.position, pair.inner->state.position[i]) / pair.inner->play);
    return most;
}

void push_about(bool torsion, unsigned seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    std::mt19937 random(seed);
    const auto between = [&](double a, double b) { return std::uniform_real_distribution<double>(a, b)(random); };
    const RodPort port{Vec3::Zero(), Vec3::UnitX()};
    WireInTube pair;
    const double bore = between(0.4e-3, 0.8e-3), radius = bore * between(0.4, 0.9), segment = between(1.5e-3, 3e-3);
    RodDesign outside = plain_rod(0.1, bore * 1.3, segment, std::pow(10.0, between(6.5, 8.0)), torsion);
    RodDesign within = plain_rod(0.12, radius, segment * between(0.4, 1.5), std::pow(10.0, between(7.5, 9.5)), torsion);
    pair.outer = &pair.rods.add(outside, port, 0.05, between(0.0, 0.3));
    pair.inner = &pair.rods.add(within, port, between(0.03, 0.06), between(0.0, 0.3));
    put_in_bore(pair, bore - radius);
    const double dt = between(1e-3, 1e-2);
    const Vec3 pull = pair.outer->model.bend_stiffness[10] * segment * segment * segment / (0.05 * 0.05) * Vec3(0.0, between(-2.0, 2.0), between(-2.0, 2.0));
    double worst = 0.0;
    for (int k = 0; k < 120; ++k) {
        pair.outer->force[pair.outer->model.node_count() - 3] = pull * std::min(1.0, k / 40.0);
        pair.inner->drive.insertion = std::clamp(pair.inner->drive.insertion + dt * 0.02 * std::sin(0.1 * k), 0.01, 0.1);
        pair.outer->drive.insertion = std::clamp(pair.outer->drive.insertion + dt * 0.01 * std::cos(0.07 * k), 0.01, 0.08);
        pair.inner->drive.rotation += dt * (torsion ? 2.0 : 0.0);
        pair.rods.step(dt);
        worst = std::max(worst, farthest(pair));
        const Vec3 left = pair.outer->report.contact_force + pair.inner->report.contact_force;
        ASSERT_LT(left.norm(), 1e-10 + 1e-9 * pair.outer->report.contact_force.norm()) << "step " << k;
        ASSERT_EQ(pair.outer->report.first_bad_node, kNoIndex);
    }
    if (std::getenv("TELL") != nullptr) std::printf("seed %u worst %.4f\n", seed, worst);
    EXPECT_LT(worst, 1.05) << "dt " << dt << ", segments " << segment << " " << within.segment;
}

TEST(BoreContact, WhatIsInABoreStaysInItWhateverPushes) {
    for (unsigned seed = 1; seed <= 12; ++seed) push_about(false, seed);
}

TEST(BoreContact, WhatIsInABoreStaysInItWhateverPushesAndTurns) {
    for (unsigned seed = 21; seed <= 28; ++seed) push_about(true, seed);
}

TEST(BoreContact, BothBendTogetherWhereThereIsNearlyNoPlay) {
    const RodPort port{Vec3::Zero(), Vec3::UnitX()};
    const double stiff = 0.25 * std::numbers::pi * (1e7 * 1e-12 + 2e8 * 0.0625e-12); // N m^2
    const double force = stiff / (0.05 * 0.05) * 0.1;
    const auto rest = [&](RodsOfATest& rods) {
        rods.rods.front()->force.back() = Vec3(0.0, force, 0.0);
        for (int k = 0; k < 1500; ++k) rods.step(2e-3);
        return rods.rods.front()->state.position.back().y();
    };
    RodsOfATest alone;
    alone.add(plain_rod(0.08, 1e-3, 2e-3, 1e7 + 2e8 * 0.0625, false), port, 0.05, 0.0);
    const double sag = rest(alone);
    for (const double ratio : {0.5, 1.0, 1.7}) { // of the segments
        WireInTube pair;
        pair.outer = &pair.rods.add(plain_rod(0.08, 1e-3, 2e-3, 1e7, false), port, 0.05, 0.0);
        pair.inner = &pair.rods.add(plain_rod(0.08, 0.5e-3, 2e-3 * ratio, 2e8, false), port, 0.05, 0.0);
        put_in_bore(pair, 5e-6);
        EXPECT_NEAR(rest(pair.rods) / sag, 1.0, 0.01) << ratio;
    }
}

TEST(BoreContact, AWireInALevelTubeLiesOnItsFloorWithItsWeight) {
    const RodPort port{Vec3::Zero(), Vec3::UnitX()};
    WireInTube pair;
    pair.outer = &pair.rods.add(plain_rod(0.1, 1e-3, 2.5e-3, 1e11, false), port, 0.06, 0.0);
    RodDesign within = plain_rod(0.1, 0.2e-3, 2e-3, 1e6, false);
    within.density = 20000.0;
    pair.inner = &pair.rods.add(within, port, 0.055, 0.0);
    put_in_bore(pair, 0.5e-3);
    pair.inner->drive.gravity = Vec3(0.0, 0.0, -9.81);
    for (int k = 0; k < 400; ++k) pair.rods.step(5e-3);
    double pressed = 0.0;
    for (const RodMeeting& m : pair.rods.meetings) pressed += m.plane.force * m.plane.normal.z();
    const double line = pair.inner->model.mass[3] / pair.inner->model.segment; // kg/m
    EXPECT_NEAR(pressed / (9.81 * line * 0.055), 1.0, 0.15); // the port carries what is near it
    EXPECT_NEAR(pair.inner->state.position.back().z() / -0.5e-3, 1.0, 0.01);
}

/// A wire drawn through a bent tube, pulled back at its tip: Euler and Eytelwein's exp(mu theta).
double drawn_over_pull(double friction, double bend, bool torsion) {
    const RodPort port{Vec3::Zero(), Vec3::UnitX()};
    WireInTube pair;
    RodDesign outside = plain_rod(0.12, 1e-3, 2e-3, 1e10, torsion);
    outside.tip = TipShape::Pigtail, outside.tip_length = 0.04, outside.tip_angle = bend;
    pair.outer = &pair.rods.add(outside, port, 0.06, friction);
    pair.inner = &pair.rods.add(plain_rod(0.16, 0.2e-3, 2e-3, 2e7, torsion), port, 0.05, friction);
    put_in_bore(pair, 0.1e-3);
    double sum = 0.0;
    for (int k = 0; k < 700; ++k) { // the tube takes its shape, the wire comes out, is pulled and drawn back
        const auto& x = pair.outer->state.position;
        const double pull = 0.02 * std::clamp((k - 250) / 100.0, 0.0, 1.0); // N
        pair.inner->force.back() = pull * (x.back() - x[x.size() - 2]).normalized();
        pair.inner->drive.insertion += k < 100 ? 0.0 : k < 250 ? 2e-4 : k < 350 ? 0.0 : -2e-5;
        pair.rods.step(5e-3);
        if (k >= 600) sum -= pair.inner->report.handle_force.x() / pull;
    }
    return sum / 100.0;
}

TEST(BoreContact, ACapstanIsAWireDrawnThroughABentTube) {
    Dice dice(41);
    double worst = 0.0;
    for (int k = 0; k < 8; ++k) {
        const double friction = k < 2 ? 0.0 : dice.between(0.05, 0.3), bend = dice.between(0.5, 3.0);
        const double off = drawn_over_pull(friction, bend, k % 2 == 1) / std::exp(friction * bend) - 1.0;
        EXPECT_NEAR(off, 0.0, 0.03) << "mu " << friction << ", bend " << bend;
        worst = std::max(worst, std::abs(off));
    }
    const double small = drawn_over_pull(0.2, 1.5, false) / std::exp(0.2 * 1.5) - 1.0, large = drawn_over_pull(0.3, 3.0, false) / std::exp(0.3 * 3.0) - 1.0;
    EXPECT_NEAR(small, 0.0, 0.02);
    EXPECT_NEAR(large, 0.0, 0.03);
    std::printf("margin: off exp(mu theta) by %.4f at mu 0.2, 1.5 rad; %.4f at mu 0.3, 3 rad; at worst %.4f of eight random ones\n", small, large, worst);
}

/// A straight wire turned by its handle in a bent tube: all of it slides around, and friction's torque is mu times its radius times what presses.
TEST(BoreContact, AHandleThatTurnsMeetsTheTorqueOfFrictionAroundTheBend) {
    Dice dice(42);
    const RodPort port{Vec3::Zero(), Vec3::UnitX()};
    for (int round = 0; round < 5; ++round) {
        const double friction = round == 0 ? 0.0 : dice.between(0.05, 0.3), radius = dice.between(0.15e-3, 0.3e-3), bend = dice.between(0.8, 2.0);
        WireInTube pair;
        RodDesign outside = plain_rod(0.12, 1e-3, 2e-3, 1e10, true);
        outside.tip = TipShape::Pigtail, outside.tip_length = 0.04, outside.tip_angle = bend;
        pair.outer = &pair.rods.add(outside, port, 0.06, friction);
        pair.inner = &pair.rods.add(plain_rod(0.16, radius, 2e-3, 2e9, true), port, 0.055, friction);
        put_in_bore(pair, dice.between(0.05e-3, 0.3e-3));
        double torque = 0.0, pressed = 0.0;
        for (int k = 0; k < 500; ++k) {
            pair.inner->drive.rotation += k < 100 ? 0.0 : 0.01;
            pair.rods.step(5e-3);
            if (k < 400) continue;
            torque += pair.inner->report.handle_torque / 100.0;
            for (const RodMeeting& m : pair.rods.meetings) pressed += m.plane.force / 100.0;
        }
        EXPECT_GT(pressed, 0.0);
        EXPECT_NEAR(torque / (radius * pressed), friction, 0.03 * std::max(friction, 0.2)) << "radius " << radius << ", bend " << bend;
    }
}

TEST(BoreContact, NearestPointsOfTheCurveAreThoseOfASearch) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    for (int shape = 0; shape < 20; ++shape) {
        std::vector<Vec3> axis{Vec3::Zero()};
        Vec3 way = Vec3::UnitX();
        for (int i = 0; i < 30; ++i) {
            way = (way + 0.25 * Vec3(unit(random), unit(random), unit(random))).normalized();
            axis.push_back(axis.back() + 2e-3 * way);
        }
        for (int k = 0; k < 20; ++k) {
            const auto node = static_cast<Index>(3 + k);
            const Vec3 place = axis[node] + 2e-4 * Vec3(unit(random), unit(random), unit(random));
            const CurvePoint at = find_on_curve(axis, place, node - 2);
            const Vec3 apart = place - ((1.0 - at.weight) * axis[at.node] + at.weight * axis[at.node + 1] + at.beside);
            const Vec3 across = apart - at.along.dot(apart) * at.along;
            EXPECT_NEAR(across.norm(), distance_to_curve(axis, place), 4e-6);
        }
    }
}

} // namespace
} // namespace trocar::fem
