#include "fem/rod/rod.hpp"
#include "fem/rod/rod_skin.hpp"

#include "base/topology.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace trocar::fem {
namespace {

RodDesign straight_design() {
    RodDesign design;
    design.length = 0.1;
    design.radius = 0.5e-3;
    design.tip = TipShape::Straight;
    design.tip_stiffness = 1.0;
    return design;
}

/// Lets the rod come to rest under constant drive.
RodReport come_to_rest(const RodModel& model, RodState& state, const RodDrive& drive, std::span<RodPlane> planes, double seconds = 2.0) {
    RodWorkspace workspace;
    RodReport report;
    for (int i = 0; i < 100; ++i) report = solve_rod(model, state, seconds / 100, 2, drive, planes, workspace);
    return report;
}

TEST(Rod, ACantileverUnderItsOwnWeightBendsAsEulerBernoulliSays) {
    const RodModel model = make_rod_model(straight_design()).value();
    RodDrive drive;
    drive.port = {Vec3::Zero(), Vec3::UnitX()};
    drive.insertion = 0.05;
    drive.gravity = Vec3(0, 0, -2.0);
    RodState state;
    place_rod(model, drive.port, drive.insertion, 0.0, state);
    const RodReport report = come_to_rest(model, state, drive, {}, 40.0);
    const double area = std::numbers::pi * 0.25e-6, second_moment = 0.25 * area * 0.25e-6;
    const double load = 1100.0 * area * 2.0; // N/m
    const double expected = load * std::pow(0.05, 4) / (8.0 * 100e6 * second_moment);
    EXPECT_NEAR(-state.position.back().z() / expected, 1.0, 0.01);
    EXPECT_LT(report.kinetic_j, 1e-12);
}

TEST(Rod, AShapedTipTakesItsRestAngleAndTurnsWithTheHandle) {
    RodDesign design = straight_design();
    design.tip = TipShape::J;
    design.tip_angle = 0.8;
    const RodModel model = make_rod_model(design).value();
    RodDrive drive;
    drive.port = {Vec3::Zero(), Vec3::UnitX()};
    drive.insertion = 0.06;
    for (const double rotation : {0.0, 1.0, 4.0}) {
        drive.rotation = rotation;
        RodState state;
        place_rod(model, drive.port, drive.insertion, rotation, state);
        come_to_rest(model, state, drive, {}, 8.0);
        const std::size_t last = model.node_count() - 1;
        const Vec3 tangent = (state.position[last] - state.position[last - 1]).normalized();
        EXPECT_NEAR(std::acos(tangent.x()), 0.8, 0.08);
        const Vec3 reference = perpendicular_axis(drive.port.direction);
        const Vec3 expected = std::cos(rotation) * reference + std::sin(rotation) * drive.port.direction.cross(reference);
        const Vec3 across = Vec3(0, tangent.y(), tangent.z()).normalized();
        EXPECT_GT(across.dot(expected), 0.99) << "rotation " << rotation;
    }
}

TEST(Rod, PushedThroughThePortItMovesWithoutAJolt) {
    const RodModel model = make_rod_model(straight_design()).value();
    RodDrive drive;
    drive.port = {Vec3(0.1, 0.2, 0.3), Vec3(0, 0.6, 0.8)};
    RodState state;
    place_rod(model, drive.port, 0.02, 0.0, state);
    RodWorkspace workspace;
    for (int i = 1; i <= 100; ++i) {
        const Vec3 before = state.position.back();
        drive.insertion = 0.02 + 0.03 * 0.01 * i;
        const RodReport report = solve_rod(model, state, 0.01, 2, drive, {}, workspace);
        ASSERT_EQ(report.first_bad_node, kNoIndex);
        const double moved = (state.position.back() - before).norm();
        ASSERT_LT(moved, 3.3e-4);
        if (i > 20) {
            ASSERT_GT(moved, 2.7e-4);
        }
    }
    EXPECT_NEAR((state.position.back() - drive.port.position).dot(drive.port.direction), 0.05, 2e-4);
}

TEST(Rod, APlaneHoldsItAndTellsTheForce) {
    const RodModel model = make_rod_model(straight_design()).value();
    RodDrive drive;
    drive.port = {Vec3::Zero(), Vec3::UnitX()};
    drive.insertion = 0.05;
    drive.contact_stiffness = 5000.0;
    RodState state;
    place_rod(model, drive.port, drive.insertion, 0.0, state);
    const Index tip = static_cast<Index>(model.node_count() - 2);
    std::vector<RodPlane> planes{{tip, 1.0, Vec3::UnitZ(), 1e-3, 0.0}}; // lifts the tip by a millimetre
    come_to_rest(model, state, drive, planes, 40.0);
    const double bending = 100e6 * 0.25 * std::numbers::pi * std::pow(0.5e-3, 4);
    const double expected = 3.0 * bending * 1e-3 / std::pow(0.05, 3);
    EXPECT_NEAR(state.position.back().z(), 1e-3, 1e-6);
    EXPECT_NEAR(planes[0].force / expected, 1.0, 0.01);
}

TEST(Rod, RefusesWhatNoRodCanBe) {
    RodDesign design = straight_design();
    design.young_modulus = 0.0;
    EXPECT_FALSE(make_rod_model(design).ok());
    design = straight_design();
    design.segment = 0.2;
    EXPECT_FALSE(make_rod_model(design).ok());
    design = straight_design();
    design.radius = std::nan("");
    EXPECT_FALSE(make_rod_model(design).ok());
}

TEST(Rod, RowsOfStiffnessAreFollowedByBendingStretchAndTwist) {
    RodDesign design = straight_design();
    design.torsion = true;
    const RodModel plain = make_rod_model(design).value();
    design.stiffness = {{0.01, 0.2}, {0.03, 1.0}, {0.05, 3.0}};
    const RodModel model = make_rod_model(design).value();
    const auto factor = [](double s) {
        if (s <= 0.01) return 0.2;
        if (s <= 0.03) return 0.2 + 0.8 * (s - 0.01) / 0.02;
        return s <= 0.05 ? 1.0 + 2.0 * (s - 0.03) / 0.02 : 3.0;
    };
    const std::size_t last = model.node_count() - 1;
    for (std::size_t i = 1; i < last; ++i) {
        const double at_node = static_cast<double>(last - i) * model.segment, at_middle = at_node - 0.5 * model.segment;
        EXPECT_NEAR(model.bend_stiffness[i] / plain.bend_stiffness[i], factor(at_node), 1e-12);
        EXPECT_NEAR(model.stretch_stiffness[i] / plain.stretch_stiffness[i], factor(at_middle), 1e-12);
        EXPECT_NEAR(model.twist_stiffness[i] / plain.twist_stiffness[i], factor(at_middle), 1e-12);
    }
    design.stiffness = {{0.03, 0.2}, {0.01, 1.0}};
    EXPECT_FALSE(make_rod_model(design).ok());
    design.stiffness = {{0.03, 0.0}};
    EXPECT_FALSE(make_rod_model(design).ok());
}

TEST(Rod, APigtailIsACoilOfItsAngleWhoseLoopsLieBesideOneAnother) {
    {
        RodDesign design = straight_design();
        design.tip = TipShape::Pigtail;
        design.tip_length = 0.04;
        design.tip_angle = 8.0;
        design.segment = 1e-3;
        design.torsion = true; // without it a coil turns about for ever
        design.transverse_drag = 1.0;
        const RodModel model = make_rod_model(design).value();
        RodDrive drive;
        drive.port = {Vec3::Zero(), Vec3::UnitX()};
        drive.insertion = 0.06;
        RodState state;
        place_rod(model, drive.port, drive.insertion, 0.0, state);
        for (int k = 0; k < 5; ++k) come_to_rest(model, state, drive, {}, 1.0); // steps of 5 ms, as a scene's
        // Nodes a turn apart stand beside one another, by the rise of a turn.
        const std::size_t tip = model.node_count() - 1, turn = static_cast<std::size_t>(std::round(2.0 * std::numbers::pi / 8.0 * 40.0));
        const double gap = (state.position[tip] - state.position[tip - turn]).norm();
        EXPECT_NEAR(gap, 2.5 * design.radius, 0.7 * design.radius);
        double angle = 0.0;
        for (std::size_t i = tip - 40; i < tip; ++i) {
            const Vec3 a = (state.position[i] - state.position[i - 1]).normalized(),
                       b = (state.position[i + 1] - state.position[i]).normalized();
            angle += std::atan2(a.cross(b).norm(), a.dot(b));
        }
        EXPECT_NEAR(angle, 8.0, 0.05);
    }
    RodDesign coarse = straight_design();
    coarse.tip = TipShape::Pigtail;
    coarse.tip_length = 0.01;
    coarse.tip_angle = 8.0;
    EXPECT_FALSE(make_rod_model(coarse).ok()) << "1.6 rad at a node";
}

TEST(RodSkin, IsClosedOutwardAndStaysWithinTheRadius) {
    RodDesign design = straight_design();
    design.tip = TipShape::J;
    design.length = 0.5;
    const RodModel model = make_rod_model(design).value();
    const RodSkin skin = make_rod_skin(model, 10000);
    EXPECT_NEAR(static_cast<double>(skin.triangles.size()), 10000.0, 300.0);
    RodState state;
    const RodPort port{Vec3::Zero(), Vec3::UnitX()};
    place_rod(model, port, 0.5, 0.0, state);
    TriMesh mesh;
    mesh.triangles = skin.triangles;
    mesh.vertices.resize(skin.vertex_count());
    std::vector<Vec3> axis(model.node_count());
    place_rod_skin(model, skin, state, port, axis, mesh.vertices);
    const SurfaceReport report = inspect_surface(mesh);
    EXPECT_TRUE(report.closed());
    EXPECT_TRUE(report.oriented());
    EXPECT_GT(report.signed_volume, 0.9 * 0.5 * std::numbers::pi * 0.25e-6);
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
        ASSERT_LE((mesh.vertices[v] - state.position[skin.vertex_node[v]]).norm(), design.radius * (1.0 + 1e-12));
}

} // namespace
} // namespace trocar::fem
