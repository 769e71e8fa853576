// Drag of a fluid: known loads, terminal velocities, and none on what moves with the flow.
#include "fem/rod/coaxial.hpp"
#include "fem/rod/mass_spring.hpp"
#include "fem/rod/rod_flow.hpp"
#include "rod_rest.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace trocar::fem {
namespace {

using test::bare_design;
using test::bending_stiffness;
using test::settle;

const RodPort kPort{Vec3::Zero(), Vec3::UnitX()};
constexpr double kViscosity = 3.5e-3, kDensity = 1060.0; // Pa s, kg/m^3

RodFlow blood(const RodDesign& design, const Vec3& velocity, double lumen_radius = 3e-3) {
    return {velocity, viscous_resistance(kViscosity, design.radius, lumen_radius), form_resistance(kDensity, design.radius)};
}

double area(const RodDesign& design) { return std::numbers::pi * design.radius * design.radius; }

TEST(RodFlow, AWireInTheMiddleOfATubeFeelsWhatCouettesFlowBetweenCylindersSays) {
    EXPECT_NEAR(viscous_resistance(kViscosity, 0.5e-3, 0.5e-3 * std::exp(1.0)), 2.0 * std::numbers::pi * kViscosity, 1e-15);
    EXPECT_EQ(viscous_resistance(kViscosity, 1e-3, 1e-3), viscous_resistance(kViscosity, 1e-3, 0.5e-3)) << "a full lumen is no singularity";
    EXPECT_GT(viscous_resistance(kViscosity, 1e-3, 1e-3), 0.0);
}

TEST(RodFlow, ACantileverAcrossAUniformFlowBendsAsUnderAnEvenLoad) {
    const RodDesign design = bare_design(0.1, 1e-3);
    const RodModel model = make_rod_model(design).value();
    RodDrive drive;
    drive.port = kPort;
    drive.insertion = 0.05;
    for (const double speed : {0.002, 0.05}) { // viscous drag prevails, form drag counts
        const std::vector<RodFlow> flow(model.node_count(), blood(design, Vec3(0, 0, speed)));
        drive.flow = flow;
        RodState state;
        place_rod(model, drive.port, drive.insertion, 0.0, state);
        settle(model, state, drive, {}, 0.05, 4000, 1e-12);
        const double load = (2.0 * flow[0].viscous + flow[0].form * speed) * speed; // N/m
        const double expected = load * std::pow(0.05, 4) / (8.0 * bending_stiffness(design));
        std::printf("margin: at %.0f mm/s the tip bends by %.4f of the analytic %.3g mm\n", 1e3 * speed,
                    state.position.back().z() / expected, 1e3 * expected);
        EXPECT_NEAR(state.position.back().z() / expected, 1.0, 0.01);
    }
}

/// Wholly inside, so that nothing holds it.
RodState free_rod(const RodModel& model, RodDrive& drive) {
    drive.port = kPort;
    drive.insertion = model.design.length;
    RodState state;
    place_rod(model, drive.port, drive.insertion, 0.0, state);
    return state;
}

TEST(RodFlow, AFallingRodReachesTheSpeedAtWhichDragIsItsWeight) {
    for (const bool springs : {false, true}) {
        RodDesign design = bare_design(0.04, 1e-3);
        if (springs) design.young_modulus = 1e6;
        const RodModel model = make_rod_model(design).value();
        const double weight = design.density * area(design) * 9.81; // N/m
        const std::vector<RodFlow> flow(model.node_count(), blood(design, Vec3::Zero()));
        const double c = flow[0].viscous, f = flow[0].form;
        const double across = (-2.0 * c + std::sqrt(4.0 * c * c + 4.0 * f * weight)) / (2.0 * f), along = weight / c;
        for (const auto& [gravity, expected] : {std::pair{Vec3(0, 0, -9.81), Vec3(0, 0, -across)}, {Vec3(9.81, 0, 0), Vec3(along, 0, 0)}}) {
            RodDrive drive;
            RodState state = free_rod(model, drive);
            drive.gravity = gravity;
            drive.flow = flow;
            RodWorkspace workspace;
            const unsigned substeps = springs ? static_cast<unsigned>(0.01 / mass_spring_substep(model)) + 1 : 2;
            for (int k = 0; k < 300; ++k) {
                if (springs)
                    (void)solve_mass_spring(model, state, 0.01, substeps, drive, {}, workspace);
                else
                    (void)solve_rod(model, state, 0.01, substeps, drive, {}, workspace);
            }
            for (const Vec3& v : state.velocity)
                EXPECT_LT((v - expected).norm(), 1e-3 * expected.norm()) << "springs " << springs; // a tenth of a micrometre a sub-step
        }
    }
}

TEST(RodFlow, NothingIsFeltByWhatGoesWithTheFlow) {
    const RodDesign design = bare_design(0.04, 1e-3);
    const RodModel model = make_rod_model(design).value();
    const Vec3 velocity(0.1, 0.05, -0.2);
    const std::vector<RodFlow> flow(model.node_count(), blood(design, velocity));
    RodDrive drive;
    RodState with = free_rod(model, drive), without = with;
    with.velocity.assign(model.node_count(), velocity);
    without.velocity = with.velocity;
    RodWorkspace workspace;
    for (int k = 0; k < 20; ++k) {
        drive.flow = flow;
        (void)solve_rod(model, with, 0.01, 2, drive, {}, workspace);
        drive.flow = {};
        (void)solve_rod(model, without, 0.01, 2, drive, {}, workspace);
    }
    for (std::size_t i = 0; i < model.node_count(); ++i) {
        EXPECT_LT((with.velocity[i] - velocity).norm(), 1e-9);
        EXPECT_LT((with.position[i] - without.position[i]).norm(), 1e-10);
    }
}

TEST(RodFlow, ItLosesEnergyToAFluidAtRestAndNeverFindsAny) {
    const RodDesign design = bare_design(0.04, 1e-3);
    const RodModel model = make_rod_model(design).value();
    const std::vector<RodFlow> flow(model.node_count(), blood(design, Vec3::Zero()));
    RodDrive drive;
    RodState state = free_rod(model, drive);
    drive.flow = flow;
    state.velocity.assign(model.node_count(), Vec3(0.3, 0.2, 0.0));
    RodWorkspace workspace;
    double last = std::numeric_limits<double>::infinity();
    for (int k = 0; k < 50; ++k) {
        const RodReport report = solve_rod(model, state, 0.01, 1, drive, {}, workspace);
        const double energy = report.kinetic_j + report.bend_j + report.stretch_j;
        ASSERT_LE(energy, last * (1.0 + 1e-9));
        last = energy;
    }
    EXPECT_LT(last, 0.05 * 0.5 * 0.13 * design.density * area(design) * 0.04);
}

/// No drag on the wire's part in the bore; drag on the free part.
TEST(RodFlow, OfAWireInACatheterOnlyWhatStandsOutFeelsIt) {
    const RodDesign catheter = bare_design(0.1, 1e-3);
    RodDesign wire = bare_design(0.15, 1e-3);
    wire.radius = 0.2e-3;
    wire.young_modulus = 5e9;
    const RodModel outer = make_rod_model(catheter).value(), inner = make_rod_model(wire).value();
    RodDrive outer_drive, inner_drive;
    outer_drive.port = inner_drive.port = kPort;
    outer_drive.insertion = 0.03 - 1e-12;
    inner_drive.insertion = 0.06;
    const double speed = 0.01;
    const std::vector<RodFlow> still(outer.node_count()), flow(inner.node_count(), blood(wire, Vec3(0, 0, speed)));
    outer_drive.flow = still;
    inner_drive.flow = flow;
    RodState outer_state, inner_state;
    place_rod(outer, kPort, outer_drive.insertion, 0.0, outer_state);
    place_rod(inner, kPort, inner_drive.insertion, 0.0, inner_state);
    RodWorkspace outer_work, inner_work;
    CoaxialWorkspace work;
    for (int k = 0; k < 1500; ++k)
        (void)solve_coaxial({outer, outer_state, outer_drive, {}, outer_work}, {inner, inner_state, inner_drive, {}, inner_work}, 0.05, 1,
                            work);
    // The catheter's tip bends under the force and the moment of the load on 30 mm of wire.
    const double load = (2.0 * flow[0].viscous + flow[0].form * speed) * speed, reach = 0.03;
    const double both = bending_stiffness(catheter) + bending_stiffness(wire), length = 0.03;
    const double force = load * reach, moment = 0.5 * load * reach * reach;
    const double expected = force * std::pow(length, 3) / (3.0 * both) + moment * length * length / (2.0 * both);
    std::printf("margin: the catheter's tip bends by %.4f of the analytic %.3g mm\n", outer_state.position.back().z() / expected,
                1e3 * expected);
    EXPECT_NEAR(outer_state.position.back().z() / expected, 1.0, 0.02);
}

} // namespace
} // namespace trocar::fem
