// A tip's rest shape as arcs: laws over random curves, and a rod that is left alone takes that shape.
#include "fem/rod/tip_arcs.hpp"
#include "fem/rod/rod.hpp"
#include "fem/rod/rod_frames.hpp"

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>

namespace trocar::fem {
namespace {

double length_of(std::span<const TipArc> arcs) {
    double length = 0.0;
    for (const TipArc& arc : arcs) length += arc.length;
    return length;
}

/// Straight pieces and arcs of 2 to 30 mm, rounder than a radius of 4 mm.
std::vector<TipArc> random_arcs(std::mt19937_64& random, bool flat) {
    std::uniform_real_distribution<double> share(0.0, 1.0);
    std::vector<TipArc> arcs;
    for (int left = std::uniform_int_distribution<int>(1, 5)(random); left > 0; --left) {
        const double length = 2e-3 + 28e-3 * share(random);
        const double most = std::min(3.0, length / 4e-3);
        arcs.push_back({length, (2.0 * share(random) - 1.0) * most, flat ? 0.0 : (2.0 * share(random) - 1.0) * std::numbers::pi});
    }
    arcs.push_back({3e-3, 0.0, 0.0});
    return arcs;
}

RodDesign rod_with(const std::vector<TipArc>& arcs, double segment) {
    RodDesign design;
    design.tip = TipShape::Curve;
    design.arcs = arcs;
    design.tip_length = length_of(arcs);
    design.tip_stiffness = 1.0;
    design.segment = segment;
    design.length = std::ceil((design.tip_length + 0.03) / segment) * segment;
    design.radius = 0.8e-3;
    design.young_modulus = 5e8;
    design.drag = 200.0;
    design.torsion = true;
    return design;
}

TEST(TipArcs, TurnByTheSumOfTheirPartsWhereverTheyAreCut) {
    std::mt19937_64 random(11);
    for (int k = 0; k < 200; ++k) {
        const std::vector<TipArc> arcs = random_arcs(random, false);
        const double length = length_of(arcs), cut = length * std::uniform_real_distribution<double>(0.0, 1.0)(random);
        const auto all = turn_of_arcs(arcs, -1.0, length + 1.0), one = turn_of_arcs(arcs, -1.0, cut), other = turn_of_arcs(arcs, cut, length + 1.0);
        for (int axis = 0; axis < 2; ++axis) EXPECT_NEAR(all[axis], one[axis] + other[axis], 1e-12) << "seed 11, curve " << k;
    }
}

TEST(TipArcs, OneArcIsDrawnAsAPartOfACircle) {
    for (const double plane : {0.0, 1.0, -2.0}) {
        const TipArc arc{30e-3, 2.5, plane};
        const std::vector<Vec3> line = draw_arcs({&arc, 1}, 60);
        const double radius = arc.length / arc.angle;
        const Vec3 side(std::cos(plane), std::sin(plane), 0.0), middle = radius * side;
        for (const Vec3& p : line) EXPECT_NEAR((p - middle).norm(), radius, 1e-12);
        EXPECT_NEAR((line.back() - middle - radius * (std::sin(2.5) * Vec3::UnitZ() - std::cos(2.5) * side)).norm(), 0.0, 1e-12);
    }
}

TEST(TipArcs, OfALineDrawThatLineInAnyFrame) {
    std::mt19937_64 random(12);
    std::normal_distribution<double> gauss;
    double worst = 0.0;
    for (int k = 0; k < 50; ++k) {
        const std::vector<Vec3> line = draw_arcs(random_arcs(random, k % 2 == 0), 400);
        const Eigen::Quaterniond turn = Eigen::Quaterniond(gauss(random), gauss(random), gauss(random), gauss(random)).normalized();
        const Vec3 shift = 0.1 * Vec3(gauss(random), gauss(random), gauss(random));
        std::vector<Vec3> moved;
        for (const Vec3& p : line) moved.push_back(turn * p + shift);
        const std::vector<TipArc> arcs = arcs_along(line), other = arcs_along(moved);
        ASSERT_EQ(arcs.size(), other.size());
        for (std::size_t i = 0; i < arcs.size(); ++i) {
            EXPECT_NEAR(arcs[i].length, other[i].length, 1e-12);
            EXPECT_NEAR(arcs[i].angle * std::cos(arcs[i].plane), other[i].angle * std::cos(other[i].plane), 1e-8) << "seed 12, curve " << k;
            EXPECT_NEAR(arcs[i].angle * std::sin(arcs[i].plane), other[i].angle * std::sin(other[i].plane), 1e-8);
        }
        const std::vector<Vec3> again = draw_arcs(arcs, 400);
        Eigen::Matrix3Xd told(3, 401), drawn(3, 401);
        for (int i = 0; i <= 400; ++i) told.col(i) = line[static_cast<std::size_t>(i)], drawn.col(i) = again[static_cast<std::size_t>(i)];
        const Eigen::Matrix4d onto = Eigen::umeyama(drawn, told, false);
        const Eigen::Matrix3Xd back = (onto.topLeftCorner<3, 3>() * drawn).colwise() + onto.topRightCorner<3, 1>();
        worst = std::max(worst, (back - told).colwise().norm().maxCoeff() / length_of(arcs));
    }
    std::printf("margin: the line is drawn again within %.2e of its length\n", worst);
    EXPECT_LT(worst, 1e-3) << "seed 12";
}

TEST(TipArcs, PlaneZeroIsTheSideOfTheLastPoint) {
    std::mt19937_64 random(13);
    std::normal_distribution<double> gauss;
    for (int k = 0; k < 50; ++k) {
        std::vector<Vec3> points;
        for (const Vec3& p : draw_arcs(random_arcs(random, false), 400)) points.push_back(p);
        const std::vector<Vec3> line = draw_arcs(arcs_along(points), 2000);
        const Vec3 tip = line.back();
        if (std::hypot(tip.x(), tip.y()) < 1e-3) continue;
        EXPECT_NEAR(std::atan2(tip.y(), tip.x()), 0.0, 0.02) << "seed 13, curve " << k;
    }
}

/// Largest distance between a rod that was left alone and its arcs as they are drawn, over the tip's length.
double settle(const std::vector<TipArc>& arcs, double segment) {
    const auto model = make_rod_model(rod_with(arcs, segment));
    EXPECT_TRUE(model.ok()) << model.error().to_string();
    if (!model.ok()) return 1.0;
    const double tip_length = model->design.tip_length;
    RodDrive drive;
    drive.port = {Vec3::Zero(), Vec3::UnitZ()};
    drive.insertion = tip_length + 10.0 * model->segment;
    RodState state;
    place_rod(*model, drive.port, drive.insertion, 0.0, state);
    RodWorkspace work;
    std::vector<RodPlane> none;
    for (int k = 0; k < 1500; ++k) (void)solve_rod(*model, state, 2e-3, 1, drive, none, work);
    constexpr std::size_t count = 1000;
    const std::vector<Vec3> line = draw_arcs(arcs, count);
    // In the frame at the curve's root: the shaft is straight.
    std::vector<Vec3> axis(model->node_count());
    carry_material_axis(*model, state, drive.port, axis);
    const std::size_t last = model->node_count() - 1;
    const double behind = tip_length / model->segment; // nodes
    const Vec3 x = axis[0], z = Vec3::UnitZ(), y = z.cross(x);
    const Vec3 root = drive.port.position + (drive.insertion - tip_length) * z;
    double farthest = 0.0;
    for (std::size_t i = last - static_cast<std::size_t>(behind); i <= last; ++i) {
        const double s = tip_length - static_cast<double>(last - i) * model->segment;
        const Vec3 wanted = line[static_cast<std::size_t>(std::lround(s / tip_length * static_cast<double>(count)))];
        farthest = std::max(farthest, (state.position[i] - root - wanted.x() * x - wanted.y() * y - wanted.z() * z).norm());
    }
    return farthest / tip_length;
}

TEST(TipArcs, ARodThatIsLeftAloneTakesTheirShape) {
    std::mt19937_64 random(14);
    double coarse_worst = 0.0, fine_worst = 0.0;
    for (int k = 0; k < 8; ++k) {
        const std::vector<TipArc> arcs = random_arcs(random, k < 3);
        const double coarse = settle(arcs, 2.5e-3), fine = settle(arcs, 1.25e-3);
        coarse_worst = std::max(coarse_worst, coarse), fine_worst = std::max(fine_worst, fine);
        std::printf("margin: curve %d of %.1f mm: away by %.4f of its length at segments of 2.5 mm, %.4f at 1.25 mm\n", k, 1e3 * length_of(arcs), coarse, fine);
    }
    EXPECT_LT(coarse_worst, 0.015) << "seed 14";
    EXPECT_LT(fine_worst, 0.004) << "seed 14";
}

TEST(RodSections, OfATubeDifferFromTheSolidOneInStretchAndTurnAlone) {
    RodDesign design;
    design.torsion = true;
    const RodModel solid = make_rod_model(design).value();
    design.stretch_factor = 0.6, design.turn_factor = 1.3;
    const RodModel tube = make_rod_model(design).value();
    EXPECT_EQ(tube.bend_stiffness, solid.bend_stiffness);
    EXPECT_EQ(tube.twist_stiffness, solid.twist_stiffness);
    EXPECT_EQ(tube.mass, solid.mass);
    EXPECT_DOUBLE_EQ(tube.stretch_stiffness[3], 0.6 * solid.stretch_stiffness[3]);
    EXPECT_DOUBLE_EQ(tube.turn_inertia[3], 1.3 * solid.turn_inertia[3]);
}

TEST(RodModels, RefuseACurveThatIsNone) {
    RodDesign design = rod_with({{0.02, 1.0, 0.0}}, 2e-3);
    ASSERT_TRUE(make_rod_model(design).ok());
    design.tip_length *= 1.01;
    EXPECT_FALSE(make_rod_model(design).ok()) << "the arcs' lengths do not add up to it";
    design = rod_with({{0.02, 1.0, 0.0}, {-0.01, 0.0, 0.0}}, 2e-3);
    EXPECT_FALSE(make_rod_model(design).ok());
    design = rod_with({{0.004, 3.0, 0.0}, {0.02, 0.0, 0.0}}, 2e-3);
    EXPECT_FALSE(make_rod_model(design).ok()) << "1.5 rad at a node";
    design.segment = 0.5e-3;
    EXPECT_TRUE(make_rod_model(design).ok());
}

} // namespace
} // namespace trocar::fem
