// The mass-spring chain of Govindaraju et al. 2005: it hangs like the rod, is stable at its derived sub-step, and its cost is printed.
#include "fem/rod/mass_spring.hpp"
#include "rod_rest.hpp"

#include <gtest/gtest.h>

#include <ctime>
#include <random>

namespace trocar::fem {
namespace {

RodDesign soft_catheter() {
    RodDesign design = test::bare_design(0.1, 2.5e-3);
    design.young_modulus = 20e6;
    design.drag = 40.0;
    design.tip = TipShape::J;
    return design;
}

RodState hang(const RodModel& model, bool mass_spring, double& seconds_a_step) {
    RodDrive drive;
    drive.port = {Vec3::Zero(), Vec3::UnitX()};
    drive.insertion = 0.05;
    drive.gravity = Vec3(0, 0, -9.81);
    RodState state;
    place_rod(model, drive.port, drive.insertion, 0.0, state);
    RodWorkspace workspace;
    const unsigned substeps = count_mass_spring_substeps(model, 0.01).value();
    constexpr int kSteps = 300;
    const std::clock_t start = std::clock();
    for (int k = 0; k < kSteps; ++k)
        mass_spring ? solve_mass_spring(model, state, 0.01, substeps, drive, {}, workspace)
                    : solve_rod(model, state, 0.01, 2, drive, {}, workspace);
    seconds_a_step = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC / kSteps;
    return state;
}

TEST(MassSpring, HangsLikeTheRodAndCostsSoMuchMore) {
    RodDesign design = soft_catheter();
    design.tip = TipShape::Straight;
    design.tip_stiffness = 1.0;
    const RodModel model = make_rod_model(design).value();
    double rod_cost = 0.0, chain_cost = 0.0;
    const RodState rod = hang(model, false, rod_cost), chain = hang(model, true, chain_cost);
    double apart = 0.0;
    for (std::size_t i = 0; i < rod.position.size(); ++i) apart = std::max(apart, (rod.position[i] - chain.position[i]).norm());
    const double sag = -rod.position.back().z();
    std::printf(
        "margin: the chain hangs within %.3g m of the rod, which sags by %.3g m; it costs %.3g ms a step of 10 ms, the rod %.3g ms: "
        "%.0f times\n",
        apart, sag, 1e3 * chain_cost, 1e3 * rod_cost, chain_cost / rod_cost);
    EXPECT_GT(sag, 3e-4);
    const double expected = std::pow(1.0 + 0.5 * model.segment / 0.05, 4); // the chain's clamp is half a segment behind the port
    EXPECT_NEAR(-chain.position.back().z() / sag, expected, 0.03 * expected);
}

/// Largest speed after a tenth of a second that began with random speeds of a millimetre a second.
double shake(double faster) {
    RodDesign design = soft_catheter();
    design.drag = 0.0;
    design.tip = TipShape::Straight;
    const RodModel model = make_rod_model(design).value();
    RodDrive drive;
    drive.port = {Vec3::Zero(), Vec3::UnitX()};
    drive.insertion = 0.09;
    RodState state;
    place_rod(model, drive.port, drive.insertion, 0.0, state);
    std::mt19937 random(7);
    for (Vec3& v : state.velocity)
        for (int axis = 0; axis < 3; ++axis) v[axis] = 1e-3 * (static_cast<double>(random() % 2001) / 1000.0 - 1.0);
    RodWorkspace workspace;
    const auto substeps = static_cast<unsigned>(0.1 / (faster * mass_spring_substep(model)));
    solve_mass_spring(model, state, 0.1, substeps, drive, {}, workspace);
    double fastest = 0.0;
    for (const Vec3& v : state.velocity) fastest = std::max(fastest, std::isfinite(v.norm()) ? v.norm() : 1e300);
    return fastest;
}

TEST(MassSpring, IsStableAtItsDerivedSubstepAndNotFarBeyond) {
    const double derived = shake(1.0), beyond = shake(1.3);
    std::printf("margin: speeds of 1 mm/s are %.3g mm/s after 0.1 s at the derived sub-step, %.3g mm/s at 1.3 of it\n", 1e3 * derived,
                1e3 * beyond);
    EXPECT_LT(derived, 1e-2);
    EXPECT_GT(beyond, 1.0);
}

TEST(MassSpring, ALoadOnItsTipGivesItsIntegralWhateverTheStep) {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> any(-1.0, 1.0);
    RodDesign design = soft_catheter();
    design.tip = TipShape::Straight;
    design.drag = design.transverse_drag = 0.0;
    const RodModel model = make_rod_model(design).value();
    for (const double step : {0.001, 0.004, 0.01}) {
        RodDrive drive;
        drive.port = {Vec3::Zero(), Vec3::UnitX()};
        drive.insertion = design.length;
        RodState state;
        place_rod(model, drive.port, drive.insertion, 0.0, state);
        RodWorkspace workspace;
        const unsigned substeps = count_mass_spring_substeps(model, step).value();
        Vec3 given = Vec3::Zero(), momentum = Vec3::Zero(); // N s
        double size = 0.0;
        for (int k = 0; k < 20; ++k) {
            drive.tip.force = 1e-5 * Vec3(any(random), any(random), any(random));
            drive.tip.force_rate = 1e-5 / step * Vec3(any(random), any(random), any(random));
            const Vec3 impulse = step * (drive.tip.force + 0.5 * step * drive.tip.force_rate);
            given += impulse, size += impulse.norm();
            (void)solve_mass_spring(model, state, step, substeps, drive, {}, workspace);
        }
        for (std::size_t i = 0; i < model.node_count(); ++i) momentum += model.mass[i] * state.velocity[i];
        EXPECT_LT((momentum - given).norm(), 1e-9 * size) << step;
    }
}

/// Across the chain, where the handle's last two nodes bend it.
TEST(MassSpring, TheHandFeelsAForceAcrossItsTip) {
    RodDesign design = soft_catheter();
    design.tip = TipShape::Straight;
    const RodModel model = make_rod_model(design).value();
    RodDrive drive;
    drive.port = {Vec3::Zero(), Vec3::UnitX()};
    drive.insertion = 0.05;
    drive.tip.force = Vec3(0.0, 1e-4, 0.0);
    RodState state;
    place_rod(model, drive.port, drive.insertion, 0.0, state);
    RodWorkspace workspace;
    const unsigned substeps = count_mass_spring_substeps(model, 0.01).value();
    RodReport report;
    for (int k = 0; k < 300; ++k) report = solve_mass_spring(model, state, 0.01, substeps, drive, {}, workspace);
    EXPECT_GT(state.position.back().y(), 1e-4);
    EXPECT_LT((report.handle_force + drive.tip.force).norm(), 1e-6 * drive.tip.force.norm()) << report.handle_force.transpose() << " N";
    EXPECT_LT((report.handle_force + report.contact_force + report.body_force).norm(), 1e-6 * drive.tip.force.norm());
}

/// Both ends stand for half a segment, with half the mass: a thrown straight chain that the fluid drags stays straight.
TEST(MassSpring, ATransverseDragSlowsItsEndsAsItDoesTheRest) {
    RodDesign design = soft_catheter();
    design.tip = TipShape::Straight;
    design.tip_stiffness = 1.0;
    design.drag = 0.0;
    design.transverse_drag = 0.5;
    const RodModel model = make_rod_model(design).value();
    RodDrive drive;
    drive.port = {Vec3::Zero(), Vec3::UnitX()};
    drive.insertion = design.length;
    RodState state;
    place_rod(model, drive.port, drive.insertion, 0.0, state);
    for (Vec3& v : state.velocity) v = Vec3(0.0, 0.1, 0.0);
    RodWorkspace workspace;
    (void)solve_mass_spring(model, state, 0.01, count_mass_spring_substeps(model, 0.01).value(), drive, {}, workspace);
    EXPECT_LT(state.velocity[5].y(), 0.09) << "it is dragged";
    for (const Vec3& v : state.velocity) EXPECT_NEAR(v.y(), state.velocity[5].y(), 1e-9);
}

TEST(MassSpring, TellsWhenItsStiffnessAsksForTooManySubsteps) {
    RodDesign design = soft_catheter();
    design.young_modulus = 200e9;
    design.segment = 0.25e-3;
    design.density = 7900.0;
    const RodModel model = make_rod_model(design).value();
    const auto count = count_mass_spring_substeps(model, 0.1);
    ASSERT_FALSE(count.ok());
    for (const char* piece : {"sub-steps", "at most 20000", "kind rod"})
        EXPECT_NE(count.error().message.find(piece), std::string::npos) << count.error().message;
    EXPECT_TRUE(count_mass_spring_substeps(model, 2e-4).ok());
}

/// A free chain along x on a floor z = 0 under every node, and gravity that leans by `slope` rad along it.
struct OnFloor {
    explicit OnFloor(double slope, double friction, double step_s) : model(make_rod_model(straight()).value()), step(step_s) {
        drive.port = {Vec3::Zero(), Vec3::UnitX()};
        drive.insertion = model.design.length + 0.01; // all of it is beyond the port
        drive.friction = friction;
        drive.gravity = 9.81 * Vec3(std::sin(slope), 0.0, -std::cos(slope));
        place_rod(model, drive.port, drive.insertion, 0.0, state);
        for (Index node = 0; node + 1 < model.node_count(); ++node) {
            if (node == 0) planes.push_back({.node = 0, .weight = 0.0, .normal = Vec3::UnitZ()});
            planes.push_back({.node = node, .weight = 1.0, .normal = Vec3::UnitZ()});
        }
        for (const double mass : model.mass) weight += 9.81 * mass;
        substeps = count_mass_spring_substeps(model, step).value();
    }
    static RodDesign straight() {
        RodDesign design = soft_catheter();
        design.tip = TipShape::Straight;
        design.tip_stiffness = 1.0;
        design.drag = design.transverse_drag = 0.0;
        return design;
    }
    RodReport advance() { return solve_mass_spring(model, state, step, substeps, drive, planes, workspace); }

    RodModel model;
    RodDrive drive;
    RodState state;
    std::vector<RodPlane> planes;
    RodWorkspace workspace;
    double step = 0.0, weight = 0.0;
    unsigned substeps = 0;
};

TEST(MassSpring, WhatRestsPressesWithItsWeightWhateverTheStep) {
    for (const double step : {2e-4, 1e-3, 1e-2}) {
        OnFloor floor(0.0, 0.3, step);
        RodReport report;
        for (double time = 0.0; time < 1.0; time += step) {
            report = floor.advance();
            EXPECT_LT((report.contact_force + report.handle_force + report.body_force).norm(), 1e-6 * floor.weight);
        }
        EXPECT_NEAR(report.contact_force.z(), floor.weight, 1e-3 * floor.weight) << step;
        EXPECT_EQ(report.unconverged, 0u) << step;
        for (const Vec3& x : floor.state.position) EXPECT_NEAR(x.z(), 0.0, 1e-9) << step;
    }
}

TEST(MassSpring, WhatFrictionHoldsDoesNotCreepAndWhatItDoesNotSlidesAsCoulombSays) {
    for (const double step : {1e-3, 1e-2})
        for (const auto& [slope, friction] : {std::pair{0.2, 0.3}, {0.3, 0.2}}) {
            OnFloor floor(slope, friction, step);
            const Vec3 from = floor.state.position.front();
            const int steps = static_cast<int>(0.5 / step);
            for (int k = 0; k < steps; ++k) (void)floor.advance();
            const double way = floor.state.position.front().x() - from.x(), time = steps * step;
            const double expected = 0.5 * 9.81 * std::max(0.0, std::sin(slope) - friction * std::cos(slope)) * time * time;
            EXPECT_NEAR(way, expected, 0.02 * expected + 1e-7) << step << " " << slope;
        }
}

/// The hand draws it along a floor at a steady speed.
TEST(MassSpring, TheHandFeelsTheFrictionOfWhatItDraws) {
    OnFloor floor(0.0, 0.3, 1e-3);
    floor.drive.insertion = 0.08;
    place_rod(floor.model, floor.drive.port, floor.drive.insertion, 0.0, floor.state);
    RodReport report;
    double force = 0.0, pressed = 0.0;
    for (int k = 0; k < 3000; ++k) {
        floor.drive.insertion = 0.08 - 5e-6 * k; // 5 mm/s
        report = floor.advance();
        if (k < 2000) continue;
        force -= report.handle_force.x() / 1000.0;
        pressed += report.contact_force.z() / 1000.0;
    }
    EXPECT_NEAR(force, 0.3 * pressed, 0.03 * force);
    EXPECT_GT(force, 1e-4);
}

} // namespace
} // namespace trocar::fem
