// Torsion: how a turn of the handle travels, builds up torsional wind-up, snaps round in a bend, and stretches a helical spring.
#include "rod_rest.hpp"

#include "fem/rod/closed_forms.hpp"
#include "fem/rod/rod_step.hpp"
#include "fem/rod/rod_trial.hpp"
#include "fem/rod/validation.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace trocar::fem {
namespace {

using test::bare_design;
using test::bending_stiffness;

constexpr double kPi = std::numbers::pi;

/// N m^2
double twist_stiffness(const RodDesign& design) { return bending_stiffness(design) / (1.0 + design.poisson_ratio); }

struct Turned {
    RodModel model;
    RodDrive drive;
    RodState state;
    RodWorkspace workspace;

    RodReport step(double dt, unsigned substeps = 1, std::span<RodPlane> planes = {}) {
        return solve_rod(model, state, dt, substeps, drive, planes, workspace);
    }
};

/// A rod with `segments` segments beyond the port, straight.
Turned straight(const RodDesign& design, int segments) {
    Turned rod{make_rod_model(design).value(), {}, {}, {}};
    rod.drive.port = {Vec3::Zero(), Vec3::UnitX()};
    rod.drive.insertion = (segments - 1e-9) * rod.model.segment;
    place_rod(rod.model, rod.drive.port, rod.drive.insertion, 0.0, rod.state);
    return rod;
}

RodDesign twisting(double length, double segment) {
    RodDesign design = bare_design(length, segment);
    design.torsion = true;
    return design;
}

TEST(RodTwist, AStepAtTheHandleTravelsAtTheSpeedOfShear) {
    const int segments = 200;
    const RodDesign design = twisting(0.204, 1e-3);
    Turned rod = straight(design, segments);
    const double shear = design.young_modulus / (2.0 + 2.0 * design.poisson_ratio);
    const double speed = std::sqrt(shear / design.density), dt = 0.1 * rod.model.segment / speed;
    rod.drive.rotation = 0.1;
    const std::size_t tip = rod.model.node_count() - 1, middle = tip - 100;
    double arrival = 0.0, sooner = 0.0;
    for (int k = 1; arrival == 0.0 && k < 3000; ++k) {
        rod.step(dt);
        if (sooner == 0.0 && rod.state.angle[middle] > 0.01) sooner = k * dt * speed / 0.1;
        if (rod.state.angle[middle] > 0.05) arrival = k * dt * speed / 0.1;
    }
    std::printf("margin: half the step is at the middle after %.3f of the time that sqrt(G / rho) says, a tenth after %.3f\n", arrival,
                sooner);
    EXPECT_NEAR(arrival, 1.0, 0.03);
    EXPECT_GT(sooner, 0.85) << "nothing is faster than shear, but for the smear of implicit steps";
}

TEST(RodTwist, AtRestAStraightRodHasTheHandlesAngleAllAlong) {
    Turned rod = straight(twisting(0.1, 2e-3), 40);
    for (int k = 0; k < 200; ++k) {
        rod.drive.rotation = std::min(2.0, 0.0314 * k);
        rod.step(0.01);
    }
    for (const double angle : rod.state.angle) EXPECT_NEAR(angle, 2.0, 1e-6);
    EXPECT_LT((rod.state.position.back() - Vec3(rod.drive.insertion, 0, 0)).norm(), 1e-9)
        << "a straight rod that is turned stays where it is";
}

/// Two walls press on the tip node from both sides with `force` newtons each.
std::vector<RodPlane> pinch(const Turned& rod, double force) {
    const Index last = static_cast<Index>(rod.model.node_count() - 2);
    const double depth = force / rod.drive.contact_stiffness;
    return {{last, 1.0, Vec3::UnitY(), depth, 0.0}, {last, 1.0, -Vec3::UnitY(), depth, 0.0}};
}

TEST(RodTwist, FrictionAtTheTipWindsTheShaftUpByTorqueTimesLengthOverStiffness) {
    const RodDesign design = twisting(0.21, 2e-3);
    Turned rod = straight(design, 100);
    rod.drive.contact_stiffness = 1e4;
    rod.drive.friction = 0.3;
    std::vector<RodPlane> planes = pinch(rod, 0.01);
    const double length = rod.drive.insertion;
    // Both walls hold with mu N at the rod's radius until the tip slips: the torsional wind-up of the shaft is T L / (G J) then.
    const double torque = 2.0 * 0.3 * 0.01 * design.radius, wound = torque * length / twist_stiffness(design);
    for (int k = 0; k < 60; ++k) {
        rod.drive.rotation = 0.0314 * k;
        rod.step(0.01, 1, planes);
    }
    const double lag = rod.drive.rotation - rod.state.angle.back();
    std::printf("margin: wound up by %.4f of T L / (G J) = %.3f rad while the tip slips\n", lag / wound, wound);
    EXPECT_LT(lag / wound, 1.001);
    EXPECT_GT(lag / wound, 0.99);
    Turned held = straight(design, 100);
    held.drive.contact_stiffness = 1e4;
    held.drive.friction = 0.3;
    for (int k = 0; k < 20; ++k) {
        held.drive.rotation = 0.5 * wound * (k + 1) / 20.0;
        held.step(0.01, 1, planes);
    }
    // Below the stick speed friction is viscous: a held tip creeps by 0.2 rad/s at this radius, at most.
    EXPECT_LT(held.state.angle.back(), 0.15 * wound) << "half the torque does not turn a tip that friction holds";
    const std::size_t middle = held.model.node_count() - 51;
    EXPECT_NEAR(held.state.angle[middle] - held.state.angle.back(), 0.5 * (held.drive.rotation - held.state.angle.back()), 1e-3 * wound)
        << "the same torque all along";
}

TEST(RodTwist, ACurvedTipInACurvedTubeWhipsWhereTheShaftCanNoLongerHoldIt) {
    // Energy of a tip at angle phi behind a shaft wound by alpha - phi: G J / (2 L) (alpha - phi)^2 - E I k1 k2 l cos(phi).
    // It snaps where 1 + beta cos(phi) = 0: at the handle's angle phi + beta sin(phi); less where the tip twists along itself.
    for (const double beta : {1.2, 2.0, 4.0}) {
        const TurnedTip stiff = turned_tip(beta, 1e-6);
        const double phi = std::acos(-1.0 / beta);
        EXPECT_NEAR(stiff.snap, phi + beta * std::sin(phi), 1e-5) << beta;
        EXPECT_NEAR(stiff.slope, 1.0 / (1.0 + beta), 1e-5) << beta;
        EXPECT_LT(turned_tip(beta, 0.2).snap, stiff.snap) << beta;
    }
    EXPECT_TRUE(std::isinf(turned_tip(0.9, 1e-6).snap)) << "a soft bend never snaps";
    const Whip whip = turn_in_bend(80, 30.0, 20.0);
    const TurnedTip expected = turned_tip(whip.beta, whip.share);
    std::printf("margin: beta %.3f: snaps by %.2f rad a step at the handle's %.3f rad, reference %.3f; first slope %.4f, reference %.4f\n",
                whip.beta, whip.jump, whip.handle, expected.snap, whip.first_slope, expected.slope);
    EXPECT_GT(whip.beta, 1.2);
    EXPECT_NEAR(whip.handle, expected.snap, 0.012 * expected.snap);
    EXPECT_GT(whip.jump, 0.5);
    EXPECT_NEAR(whip.first_slope, expected.slope, 0.01 * expected.slope);
    EXPECT_NEAR(whip.last, 0.0, 1.6) << "after a turn it has followed, but for the friction of the bend";
    const Whip calm = turn_in_bend(80, 30.0, 6.0);
    std::printf("margin: beta %.3f: turns by %.3f rad a step at most\n", calm.beta, calm.jump);
    EXPECT_LT(calm.beta, 0.8);
    EXPECT_LT(calm.jump, 0.05) << "ten times the handle's step: a soft bend never snaps";
}

/// Angle at the tip, and where the tip is: a helix of rest curvature and torsion, hanging from the port.
RodState hang_helix(double curvature, double torsion, double length, int segments, const Vec3& gravity) {
    const double segment = length / segments;
    RodDesign design = twisting((segments + 4) * segment, segment);
    design.young_modulus = 1e9;
    design.drag = 200.0;
    Turned rod = straight(design, segments);
    const std::size_t last = rod.model.node_count() - 1;
    for (std::size_t i = last - static_cast<std::size_t>(segments); i < last; ++i) {
        const double s = static_cast<double>(i + static_cast<std::size_t>(segments) - last) * segment;
        rod.model.rest_curvature[i] = {curvature * std::cos(torsion * s), curvature * std::sin(torsion * s)};
    }
    rod.drive.gravity = gravity;
    for (int k = 0; k < 1000; ++k) rod.step(2e-3);
    return rod.state;
}

TEST(RodTwist, RestCurvatureThatTurnsWithTheLengthIsAHelix) {
    const double curvature = 60.0, torsion = 25.0, length = 0.1;
    const double sum = curvature * curvature + torsion * torsion, radius = curvature / sum, rise = torsion / std::sqrt(sum);
    double last_error = 0.0;
    for (const int segments : {25, 50, 100}) {
        const RodState state = hang_helix(curvature, torsion, length, segments, Vec3::Zero());
        const std::size_t tip = state.position.size() - 1, first = tip - static_cast<std::size_t>(segments) + 1;
        Vec3 axis = Vec3::Zero(), before = Vec3::Zero();
        for (std::size_t i = first; i < tip; ++i) {
            const Vec3 normal = second_difference(state.position, i).normalized();
            if (i > first) axis += before.cross(normal);
            before = normal;
        }
        axis.normalize();
        const double h = length / segments;
        const double along = (state.position[tip] - state.position[first]).dot(axis) / (static_cast<double>(tip - first) * h);
        const auto flat = [&](std::size_t i) { return Vec3(state.position[i] - state.position[i].dot(axis) * axis); };
        const Vec3 a = flat(first), b = flat((2 * first + tip) / 3), c = flat((first + 2 * tip) / 3);
        const double measured = (a - b).norm() * (b - c).norm() * (c - a).norm() / (2.0 * (b - a).cross(c - a).norm());
        const double error = std::abs(measured / radius - 1.0) + std::abs(along / rise - 1.0);
        std::printf("margin: helix of %d segments: radius %.5f of the analytic, rise %.5f, error ratio %.2f\n", segments, measured / radius,
                    along / rise, last_error / error);
        if (segments == 100) {
            EXPECT_NEAR(measured / radius, 1.0, 3e-3);
            EXPECT_NEAR(along / rise, 1.0, 3e-3);
        }
        if (last_error > 0.0) {
            EXPECT_GT(last_error / error, 2.5);
        }
        last_error = error;
    }
}

/// Tip displacement of a clamped rod of any rest shape under a small weight. source: Castigliano's theorem, unit load at the tip.
Vec3 castigliano(const RodState& rest, std::size_t first, const RodDesign& design, const Vec3& gravity) {
    const std::size_t tip = rest.position.size() - 1;
    const double h = design.segment, ei = bending_stiffness(design), gj = twist_stiffness(design);
    const double line = design.density * kPi * design.radius * design.radius; // kg/m
    Vec3 moved = Vec3::Zero();
    for (std::size_t i = first; i < tip; ++i) { // every node that bends, with a segment's length around it
        const Vec3& x = rest.position[i];
        const Vec3 t = rod_tangent(rest.position, i, Vec3::UnitX());
        Vec3 weight = Vec3::Zero();
        for (std::size_t j = i + 1; j <= tip; ++j) weight += (rest.position[j] - x).cross(gravity) * line * h * (j == tip ? 0.5 : 1.0);
        for (int axis = 0; axis < 3; ++axis) {
            const Vec3 unit = (rest.position[tip] - x).cross(Vec3::Unit(axis));
            const double twisted = weight.dot(t) * unit.dot(t);
            moved[axis] += h * (twisted / gj + (weight.dot(unit) - twisted) / ei);
        }
    }
    return moved;
}

TEST(RodTwist, AHelicalSpringGivesWayUnderItsWeightAsCastiglianoSays) {
    const int segments = 100;
    const double length = 0.1;
    RodDesign design = twisting(length, length / segments);
    design.young_modulus = 1e9;
    const RodState rest = hang_helix(60.0, 25.0, length, segments, Vec3::Zero());
    const std::size_t tip = rest.position.size() - 1, first = tip - static_cast<std::size_t>(segments);
    for (const Vec3& gravity : {Vec3(0.01, 0, 0), Vec3(0, 0.01, 0), Vec3(0, 0, 0.01)}) {
        const RodState loaded = hang_helix(60.0, 25.0, length, segments, gravity);
        const Vec3 moved = loaded.position[tip] - rest.position[tip], expected = castigliano(rest, first, design, gravity);
        std::printf("margin: spring moves by (%.4g, %.4g, %.4g) m, Castigliano (%.4g, %.4g, %.4g)\n", moved.x(), moved.y(), moved.z(),
                    expected.x(), expected.y(), expected.z());
        EXPECT_LT((moved - expected).norm(), 0.03 * expected.norm());
    }
}

TEST(RodTwist, DrivenToAndFroThroughThePortItNeverJoltsAndWindsDown) {
    RodDesign design = bare_design(0.2, 2e-3);
    design.torsion = true;
    design.tip = TipShape::J;
    design.transverse_drag = 10.0;
    design.drag = 40.0;
    Turned rod{make_rod_model(design).value(), {}, {}, {}};
    rod.drive.port = {Vec3::Zero(), Vec3::UnitX()};
    place_rod(rod.model, rod.drive.port, 0.05, 0.0, rod.state);
    rod.drive.insertion = 0.05;
    for (int k = 0; k < 400; ++k) rod.step(0.01, 2);
    double fastest = 0.0;
    for (int k = 1; k <= 400; ++k) {
        const double before = rod.state.angle.back();
        rod.drive.insertion = 0.05 + 0.02 * std::sin(0.03 * k); // 35 mm/s at most with this step and slower
        rod.drive.rotation = 0.0314 * std::min(k, 100);
        const RodReport report = rod.step(0.01, 2);
        ASSERT_EQ(report.first_bad_node, kNoIndex);
        fastest = std::max(fastest, std::abs(rod.state.angle.back() - before));
    }
    std::printf("margin: the tip turns by %.3f of the handle's limit in a step at most\n", fastest / 0.0314);
    EXPECT_LT(fastest, 2.0 * 0.0314);
    for (const double angle : rod.state.angle) EXPECT_NEAR(angle, 3.14, 0.02);
}

/// Straight or curved at rest, thrown aside, wound by up to twelve turns and held at both ends, which are nearer to one another than its length.
struct WoundRod {
    explicit WoundRod(unsigned seed) : random(seed), rod(0.1, static_cast<int>(from(12.0, 64.0)), from(0.5e-3, 2e-3), true, from(5.0, 40.0)) {
        const double curvature = seed % 3 == 0 ? 0.0 : 30.0, turn = 2.0 * kPi * from(0.3, 12.0);
        for (std::size_t i = rod.first(); i + 1 < rod.model.node_count(); ++i)
            rod.model.rest_curvature[i] = {from(-curvature, curvature), seed % 3 == 1 ? from(-curvature, curvature) : 0.0};
        rod.wind(turn);
        const Vec3 tip = rod.tip();
        for (Vec3& x : rod.state.position)
            if (x.x() > 0.0) x += from(0.0, 2e-4) * Vec3(from(-1.0, 1.0), from(-1.0, 1.0), from(-1.0, 1.0));
        rod.clamp_tip(tip - from(0.0, 0.03) * Vec3::UnitX(), Vec3::UnitX(), turn);
    }
    double from(double low, double high) { return low + (high - low) * (random() / 4294967296.0); }

    std::mt19937 random;
    RodTrial rod;
};

TEST(RodTwist, WhatIsWoundAndHeldLosesEnergyUntilItRests) {
    constexpr double kSteps[] = {2e-3, 5e-3, 1e-2};
    constexpr unsigned kRods = 12, kMostRestless = 2; // those that buckle to and fro within a step's iteration
    unsigned restless = 0;
    for (unsigned seed = 1; seed <= kRods; ++seed) {
        WoundRod wound(seed);
        const double dt = kSteps[seed % 3];
        double before = 0.0;
        unsigned unsettled = 0;
        RodReport report;
        for (double t = 0.0; t < 6.0; t += dt) {
            report = wound.rod.step(dt);
            const double energy = report.bend_j + report.stretch_j + report.twist_j + report.kinetic_j;
            if (t > 0.05 && unsettled == 0) EXPECT_LT(energy, 1.01 * before) << "seed " << seed << " at " << t << " s"; // until then the clamp works
            if (t > 0.05) unsettled += report.unconverged;
            before = energy;
        }
        if (report.unconverged > 0)
            ++restless;
        else
            EXPECT_LT(report.kinetic_j, 1e-10 * before) << "seed " << seed;
    }
    std::printf("margin: %u of %u wound rods do not settle\n", restless, kRods);
    EXPECT_LE(restless, kMostRestless);
}

} // namespace
} // namespace trocar::fem
