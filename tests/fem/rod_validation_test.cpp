// The rod against analytic elastica: large bending, buckling, rest shapes, and how the error falls with the segments.
#include "fem/rod/validation.hpp"
#include "rod_rest.hpp"

#include <gtest/gtest.h>

namespace trocar::fem {
namespace {

using test::bare_design;
using test::bending_stiffness;
using test::settle;

constexpr double kHalfTurn = std::numbers::pi;

/// Load whose elastica has its tip `across` lengths aside.
double load_for(double across) {
    double low = 0.0, high = 20.0;
    for (int i = 0; i < 40; ++i) {
        const double middle = 0.5 * (low + high);
        (loaded_elastica(middle).across > across ? high : low) = middle;
    }
    return 0.5 * (low + high);
}

struct Lifted {
    double force = 0.0;    // N on the tip
    double along = 0.0;    // m, of the tip
    double sharpest = 0.0; // rad at a node
};

/// A rod with `segments` segments from the clamp to the tip, `length` metres; a node stands in the port.
struct Clamped {
    RodModel model;
    RodDrive drive;
};
Clamped clamp(double length, int segments, double radius = 0.5e-3) {
    const double segment = length / segments;
    RodDesign design = bare_design((segments + 4) * segment, segment);
    design.radius = radius;
    Clamped rod{make_rod_model(design).value(), {}};
    rod.drive.port = {Vec3::Zero(), Vec3::UnitX()};
    rod.drive.insertion = (segments - 1e-9) * segment;
    return rod;
}

/// The tip of a clamped rod, lifted `height` metres by a plane.
Lifted lift_tip(double length, int segments, double height, double radius = 0.5e-3) {
    auto [model, drive] = clamp(length, segments, radius);
    drive.contact_stiffness = 1e5;
    RodState state;
    place_rod(model, drive.port, drive.insertion, 0.0, state);
    std::vector<RodPlane> planes{{static_cast<Index>(model.node_count() - 2), 1.0, Vec3::UnitZ(), 0.0, 0.0}};
    for (int k = 1; k <= 20; ++k) { // a jump of the plane by half the length would fold the rod
        planes[0].offset = height * k / 20;
        settle(model, state, drive, planes, 0.05, k == 20 ? 2000 : 20);
    }
    Lifted lifted{planes[0].force, state.position.back().x(), 0.0};
    for (std::size_t i = 1; i + 1 < model.node_count(); ++i) {
        const Vec3 a = (state.position[i] - state.position[i - 1]).normalized(),
                   b = (state.position[i + 1] - state.position[i]).normalized();
        lifted.sharpest = std::max(lifted.sharpest, std::atan2(a.cross(b).norm(), a.dot(b)));
    }
    return lifted;
}

TEST(RodValidation, ACantileverUnderAnEndLoadIsTheElasticaFarBeyondSmallBending) {
    const double length = 0.06, ei = bending_stiffness(bare_design(0.1, 1e-3));
    for (const double across : {0.1, 0.3, 0.6, 0.75}) {
        const double alpha = load_for(across);
        const Lifted rod = lift_tip(length, 60, across * length);
        const double expected_along = loaded_elastica(alpha).along * length;
        std::printf("margin: tip %.2f L aside: load over the elastica's %.5f, its place along off by %.2e L\n", across,
                    rod.force * length * length / (ei * alpha), (rod.along - expected_along) / length);
        EXPECT_NEAR(rod.force * length * length / (ei * alpha), 1.0, 3e-3) << across;
        EXPECT_NEAR(rod.along / length, expected_along / length, 5e-4) << across;
    }
}

TEST(RodValidation, ErrorsFallWithTheSquareOfTheSegment) {
    // Thin, so that it hardly stretches: the elastica does not.
    const double length = 0.06, radius = 1e-4, ei = bending_stiffness(bare_design(0.1, 1e-3)) * std::pow(radius / 0.5e-3, 4);
    const double alpha = load_for(0.6);
    double last = 0.0;
    for (const int segments : {10, 20, 40}) {
        const Lifted rod = lift_tip(length, segments, 0.6 * length, radius);
        const double error = std::abs(rod.force * length * length / (ei * alpha) - 1.0);
        std::printf("margin: %d segments: load off by %.3e, sharpest node %.3f rad, ratio %.2f\n", segments, error, rod.sharpest,
                    last / error);
        if (last > 0.0) {
            EXPECT_GT(last / error, 3.3) << "order " << std::log2(last / error);
            EXPECT_LT(last / error, 4.8) << "order " << std::log2(last / error);
        }
        last = error;
    }
}

/// Complete elliptic integrals K(m), E(m) by the arithmetic-geometric mean. source: Abramowitz & Stegun 17.6.
struct Elliptic {
    double k, e;
};
Elliptic elliptic(double m) {
    double a = 1.0, b = std::sqrt(1.0 - m), c = std::sqrt(m), sum = 0.5 * m, power = 0.5;
    while (std::abs(c) > 1e-15) {
        c = 0.5 * (a - b);
        const double mean = 0.5 * (a + b);
        b = std::sqrt(a * b);
        a = mean;
        power *= 2.0;
        sum += power * c * c;
    }
    return {0.5 * kHalfTurn / a, 0.5 * kHalfTurn / a * (1.0 - sum)};
}

struct Pressed {
    double force = 0.0; // N at the tip
    double aside = 0.0; // m, of the tip
};

/// Pushes a rod of effective length `length` by `shortening` metres against a frictionless wall across its way.
Pressed press(double length, double shortening, double nudge) {
    auto [model, drive] = clamp(length, 60);
    drive.gravity = Vec3(0, 0, nudge);
    drive.contact_stiffness = 1e6;
    RodState state;
    place_rod(model, drive.port, drive.insertion, 0.0, state);
    std::vector<RodPlane> planes{{static_cast<Index>(model.node_count() - 2), 1.0, -Vec3::UnitX(), -drive.insertion, 0.0}};
    for (int k = 1; k <= 40; ++k) {
        planes[0].offset = -drive.insertion + shortening * k / 40;
        settle(model, state, drive, planes, 0.05, k == 40 ? 4000 : 10);
    }
    return {planes[0].force, state.position.back().z()};
}

TEST(RodValidation, BucklesAtEulersLoadAndNotBelowIt) {
    const double length = 0.06;
    const RodDesign design = bare_design(length, 1e-3);
    const double euler = kHalfTurn * kHalfTurn * bending_stiffness(design) / (4.0 * length * length);
    const double axial = design.young_modulus * kHalfTurn * design.radius * design.radius / length; // N/m
    // A weight a millionth of gravity breaks the symmetry: it bends by w L^4 / (8 E I) / (1 - P / P_euler), about.
    const double nudge = 1e-5, area = kHalfTurn * design.radius * design.radius;
    const double unloaded = design.density * area * nudge * std::pow(length, 4) / (8.0 * bending_stiffness(design));
    const Pressed below = press(length, 0.9 * euler / axial, nudge);
    std::printf("margin: at %.4f of Euler's load the tip is %.2f times as far aside as without it\n", below.force / euler,
                below.aside / unloaded);
    EXPECT_NEAR(below.force / euler, 0.9, 0.01);
    EXPECT_LT(below.aside, 15.0 * unloaded);
    const Pressed above = press(length, 1.2 * euler / axial, nudge);
    std::printf("margin: shortened as 1.2 times Euler's load would: load %.4f of Euler's, tip %.3g m aside\n", above.force / euler,
                above.aside);
    EXPECT_NEAR(above.force / euler, 1.0, 2e-3);
    EXPECT_GT(above.aside, 1e4 * unloaded);
}

TEST(RodValidation, FarBeyondBucklingItsLoadIsTheElasticas) {
    const double length = 0.06;
    const RodDesign design = bare_design(length, 1e-3);
    const double euler = kHalfTurn * kHalfTurn * bending_stiffness(design) / (4.0 * length * length);
    for (const double tip_angle : {0.5, 1.0, 1.5}) {
        const double m = std::pow(std::sin(0.5 * tip_angle), 2);
        const Elliptic full = elliptic(m);
        const double load = std::pow(2.0 * full.k / kHalfTurn, 2), shortening = 2.0 - 2.0 * full.e / full.k;
        const Pressed rod = press(length, shortening * length, 1e-3);
        std::printf("margin: shortened to %.3f L: load %.4f of Euler's, the elastica's %.4f\n", 1.0 - shortening, rod.force / euler, load);
        EXPECT_NEAR(rod.force / euler, load, 4e-3 * load) << tip_angle;
        EXPECT_NEAR(std::abs(rod.aside) / length, 2.0 * std::sin(0.5 * tip_angle) / full.k, 4e-3) << tip_angle;
    }
}

TEST(RodValidation, ConstantRestCurvatureClosesToACircle) {
    double last = 0.0;
    for (const int segments : {16, 32, 64}) {
        const double gap = rolled_gap(segments);
        std::printf("margin: circle of %d segments closes to %.3e of its length, ratio %.2f\n", segments, gap, last / gap);
        EXPECT_LT(gap, 1.5 * 2.0 * kHalfTurn / 24.0 * std::pow(2.0 * kHalfTurn / segments, 2)) << segments;
        if (last > 0.0) {
            EXPECT_GT(last / gap, 3.3) << segments;
        }
        last = gap;
    }
}

} // namespace
} // namespace trocar::fem
