// Nodes that pass the port: no jolt in stiffness, in the force at the tip, or in its place, inwards and outwards.
#include "rod_rest.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace trocar::fem {
namespace {

using test::bare_design;
using test::bending_stiffness;
using test::settle;

constexpr double kLength = 0.05, kSegment = 2e-3; // m: a node stands on the port
const RodPort kAtOrigin{Vec3::Zero(), Vec3::UnitX()};

RodDesign port_design() { return bare_design(0.1, kSegment); }

RodModel port_model() { return make_rod_model(port_design()).value(); }

/// N/m, of a cantilever of that insertion against a small push on its tip.
double stiffness_at(const RodModel& model, double insertion, const Vec3& across) {
    RodDrive drive;
    drive.port = kAtOrigin;
    drive.insertion = insertion;
    drive.contact_stiffness = 20.0; // of the order of the rod's, so that both give way
    RodState state;
    place_rod(model, drive.port, insertion, 0.0, state);
    const bool along = across.dot(kAtOrigin.direction) != 0.0;
    const double push = along ? 1e-6 : 1e-4; // m; along it less than it buckles at
    const double at = along ? -insertion : 0.0;
    std::vector<RodPlane> planes{{static_cast<Index>(model.node_count() - 2), 1.0, across, at + push, 0.0}};
    if (along) drive.contact_stiffness = 2e4;
    settle(model, state, drive, planes, 5.0, 400, 1e-13);
    return planes[0].force / (across.dot(state.position.back()) - at);
}

TEST(RodPort, ANodeThatPassesLeavesTheStiffnessAcrossAsItWas) {
    const RodModel model = port_model();
    double largest_jump = 0.0, largest_error = 0.0, last = 0.0;
    for (int k = -30; k <= 30; ++k) { // from a segment and a half before the node to as far behind it
        const double insertion = kLength + k * 1e-4;
        const double stiffness = stiffness_at(model, insertion, Vec3::UnitZ());
        const double beam = 3.0 * bending_stiffness(model.design) / std::pow(insertion, 3);
        if (last > 0.0) largest_jump = std::max(largest_jump, std::abs(stiffness / last - 1.0));
        largest_error = std::max(largest_error, std::abs(stiffness / beam - 1.0));
        last = stiffness;
    }
    std::printf("margin: stiffness changes by %.4f at most in 0.1 mm, where a beam's changes by 0.0060; %.4f from a beam's at most\n",
                largest_jump, largest_error);
    EXPECT_LT(largest_jump, 0.02);
    EXPECT_LT(largest_error, 0.01);
    const double before = stiffness_at(model, kLength - 1e-9, Vec3::UnitZ()), after = stiffness_at(model, kLength + 1e-9, Vec3::UnitZ());
    std::printf("margin: as a node passes the stiffness changes by %.5f\n", after / before - 1.0);
    EXPECT_NEAR(after / before, 1.0, 0.005);
}

TEST(RodPort, ANodeThatPassesLeavesTheStiffnessAlongAsItWas) {
    const RodModel model = port_model();
    const double before = stiffness_at(model, kLength - 1e-9, -Vec3::UnitX()), after = stiffness_at(model, kLength + 1e-9, -Vec3::UnitX());
    const double column = model.stretch_stiffness[0] * kSegment / kLength; // E A / L
    EXPECT_NEAR(before / column, 1.0, 0.01);
    EXPECT_NEAR(after / before, 1.0, 0.005);
}

/// Pushed in or drawn out at 35 mm/s past several nodes while a plane holds the tip aside: the force on the plane.
void expect_smooth_force(const RodModel& model, double from, double to, double most) {
    RodDrive drive;
    drive.port = kAtOrigin;
    drive.insertion = from;
    drive.contact_stiffness = 2e4;
    RodState state;
    place_rod(model, drive.port, from, 0.0, state);
    std::vector<RodPlane> planes{{static_cast<Index>(model.node_count() - 2), 1.0, Vec3::UnitZ(), 2e-3, 0.0}};
    settle(model, state, drive, planes);
    RodWorkspace workspace;
    double last = 0.0, largest = 0.0;
    Vec3 tip = state.position.back();
    const int steps = static_cast<int>(std::abs(to - from) / 35e-5);
    for (int k = 1; k <= steps; ++k) {
        drive.insertion = from + (to - from) * k / steps;
        const RodReport report = solve_rod(model, state, 0.01, 2, drive, planes, workspace);
        ASSERT_EQ(report.first_bad_node, kNoIndex);
        const double beam = 3.0 * bending_stiffness(model.design) * 2e-3 / std::pow(drive.insertion, 3);
        const double share = planes[0].force / beam; // of what a beam of that length would press with
        if (k > 3) largest = std::max(largest, std::abs(share - last));
        last = share;
        ASSERT_LT(std::abs((state.position.back() - tip).norm() - std::abs(to - from) / steps), 2e-5) << k;
        tip = state.position.back();
    }
    std::printf("margin: from %.0f to %.0f mm the tip's force changes by %.4f of a beam's in a step at most\n", 1e3 * from, 1e3 * to,
                largest);
    EXPECT_LT(largest, most);
}

/// Behind its port there is nothing that a handle could wind up.
TEST(RodPort, ARodThatIsAllInItsPortIsTurnedWithoutATorque) {
    RodDesign design = port_design();
    design.torsion = true;
    const RodModel model = make_rod_model(design).value();
    RodDrive drive;
    drive.port = kAtOrigin;
    RodState state;
    place_rod(model, drive.port, 0.0, 0.0, state);
    RodWorkspace work;
    for (int k = 1; k <= 5; ++k) {
        drive.rotation = 0.3 * k;
        const RodReport report = solve_rod(model, state, 0.01, 1, drive, {}, work);
        EXPECT_EQ(report.handle_torque, 0.0);
        EXPECT_EQ(report.handle_force, Vec3::Zero());
    }
}

TEST(RodPort, PushedInOrDrawnOutTheTipPressesWithoutAJolt) {
    RodDesign design = port_design();
    design.drag = 40.0; // without whip_drag, whose force exceeds the rod's press
    for (const bool torsion : {false, true}) {
        design.torsion = torsion;
        const RodModel model = make_rod_model(design).value();
        expect_smooth_force(model, 0.045, 0.055, 0.01);
        expect_smooth_force(model, 0.055, 0.045, 0.01);
    }
}

/// A bent tip that comes in: what has not passed the port yet must not bend the rest.
TEST(RodPort, AShapedTipComesInWithoutAJolt) {
    RodDesign design = port_design();
    design.tip = TipShape::J;
    design.drag = 40.0;
    design.transverse_drag = 10.0;
    const RodModel model = make_rod_model(design).value();
    for (const bool inwards : {true, false}) {
        RodDrive drive;
        drive.port = kAtOrigin;
        drive.insertion = inwards ? 0.004 : 0.02;
        RodState state;
        place_rod(model, drive.port, drive.insertion, 0.0, state);
        settle(model, state, drive);
        RodWorkspace workspace;
        double angle = 0.0, largest = 0.0;
        const auto tip_angle = [&] {
            const std::size_t last = model.node_count() - 1;
            const Vec3 tangent = (state.position[last] - state.position[last - 1]).normalized();
            return std::acos(std::clamp(tangent.x(), -1.0, 1.0));
        };
        angle = tip_angle();
        for (int k = 0; k < 45; ++k) {
            drive.insertion += inwards ? 3.5e-4 : -3.5e-4;
            (void)solve_rod(model, state, 0.01, 2, drive, {}, workspace);
            largest = std::max(largest, std::abs(tip_angle() - angle));
            angle = tip_angle();
        }
        // 0.8 rad over 15 mm: in a step 0.35 mm of it.
        std::printf("margin: the tip turns by %.4f rad in a step at most, %.4f of rest angle come in\n", largest, 0.8 * 0.35 / 15.0);
        EXPECT_LT(largest, 2.0 * 0.8 * 0.35 / 15.0);
    }
}

} // namespace
} // namespace trocar::fem
