// A rod that is far stiffer than the tissue that it presses into: both come to rest, whatever the step.
#include "bench/closed_end.hpp"
#include "step_fixture.hpp"

namespace trocar::engine {
namespace {

Held hold_checked(const ClosedEnd& scene) {
    const Held held = hold(scene);
    EXPECT_TRUE(held.finite);
    return held;
}

/// A straight rod of 2 GPa and 1 mm, pushed 40 mm round a curve of 40 mm of a bore of 2.5 mm in 50 kPa, and held.
std::string curved_channel() {
    std::string axis = "[0, 0, -10, 2.5], [0, 0, -5, 2.5]";
    for (int k = 0; k < 9; ++k) axis += fmt::format(", [{}, 0, {}, 2.5]", 40.0 * (1.0 - std::cos(0.2 * k)), 40.0 * std::sin(0.2 * k));
    return R"({"name": "curved", "units": {"length": "mm", "pressure": "kPa"}, "time": {"step": 0.01, "duration": 4}, "budget": "exact",
    "bodies": {"block": {"kind": "deformable", "surface": {"shape": "box", "centre": [15, 0, 30], "extent": [70, 40, 60], "cells": 8},
            "material": {"young_modulus": 50, "poisson_ratio": 0.4, "density": 1000, "viscosity": 0.02},
            "coarse": {"mesher": "lattice", "surface_triangles": 2000}, "fixed": [{"box": [[-25, -25, 55], [55, 25, 65]]}]},
        "channel": {"kind": "static", "hollow": true, "embedded_in": "block", "blend": 5, "surface": {"shape": "tube", "sides": 16, "axis": [)" + axis + R"(]}}},
    "instruments": {"rod": {"length": 120, "radius": 1.0, "young_modulus": 2000000, "density": 1100, "segment": 2.5, "skin_triangles": 2000,
        "tip": {"shape": "straight"}, "stiffness": [[0, 1]], "inserted": 10, "friction": 0.1, "lumen": "channel",
        "entry": {"position": [0, 0, -5], "direction": [0, 0, 1]}, "path": [[0, 10, 0], [2, 50, 0], [10, 50, 0]]}},
    "effects": ["elasticity", "damping", "coarse_contact", "exact_contact", "friction"]})";
}

/// Facets that open and close one another must not keep its solve from an end, or the tissue is handed what no rod ever pushed with.
TEST(RodInTissue, AStiffRodRoundACurveSettlesAndCrushesNothing) {
    const PreparedScene prepared = test::prepare(curved_channel());
    Simulator simulator(prepared.model);
    unsigned unsettled = 0;
    double highest = 0.0, least = INFINITY;
    for (int step = 0; step < 400; ++step) {
        const StepReport& report = simulator.step();
        ASSERT_TRUE(report.finite) << report.failure;
        EXPECT_EQ(report.inverted_tets, 0U);
        unsettled += report.unsettled_rods;
        highest = std::max(highest, std::abs(report.handle_force_n));
        if (step >= 300) least = std::min(least, report.handle_force_n);
    }
    EXPECT_LE(unsettled, 3U);
    EXPECT_LT(highest, 2.5) << "N";
    EXPECT_GT(least, 0.5) << "N, held";
}

/// Whatever the rod's stiffness against the tissue's, and whatever the step: one force, one place, and no more on the way there.
TEST(RodInTissue, APushIntoAClosedEndComesToTheSameForceAndPlaceAtEveryStep) {
    for (const double modulus : {200.0, 2000.0, 20000.0}) {
        Held first;
        for (const double step : {0.005, 0.01, 0.002}) {
            SCOPED_TRACE(fmt::format("{} MPa, steps of {} s", modulus, step));
            const Held held = hold_checked({.step = step, .modulus_mpa = modulus});
            if (step == 0.005) first = held;
            EXPECT_GT(held.mean, 0.4) << "N";
            EXPECT_LT(held.most, 1.01 * held.mean) << "N";
            EXPECT_GT(held.least, 0.99 * held.mean) << "N";
            EXPECT_LT(held.highest, 1.05 * held.mean) << "N";
            EXPECT_NEAR(held.mean, first.mean, 0.01 * first.mean) << "N";
            EXPECT_NEAR(held.tip, first.tip, 0.01e-3) << "m";
            EXPECT_LT(held.gap, 0.05 * held.mean) << "N: at rest both feel the same, as well as two solves know it";
            EXPECT_LE(held.unsettled, 3U);
            EXPECT_LE(held.corrections, 5U);
        }
    }
}

/// Soft catheters, soft and stiff tissue: of the two the softer one gives, and neither rings.
TEST(RodInTissue, WhateverIsSofterBothComeToRest) {
    struct Pair {
        double modulus_mpa, tissue_kpa;
    };
    for (const Pair pair : {Pair{20, 50}, {60, 50}, {200, 2}, {2000, 2}, {200, 500}, {2000, 500}}) {
        SCOPED_TRACE(fmt::format("{} MPa in {} kPa", pair.modulus_mpa, pair.tissue_kpa));
        const Held held = hold_checked({.modulus_mpa = pair.modulus_mpa, .tissue_kpa = pair.tissue_kpa});
        EXPECT_LT(held.most, 1.01 * held.mean) << "N";
        EXPECT_GT(held.least, 0.99 * held.mean) << "N";
        EXPECT_LT(held.highest, 1.5 * held.mean) << "N";
    }
}

/// A mesh of tetrahedra twice as long as the channel is wide: every facet near the rod has a plane, and none has to be corrected.
TEST(RodInTissue, ACoarseMeshHoldsAsStillAsAFineOne) {
    for (const double modulus : {200.0, 2000.0}) {
        double first = 0.0;
        for (const double step : {0.01, 0.002}) {
            SCOPED_TRACE(fmt::format("{} MPa, steps of {} s", modulus, step));
            const Held held = hold_checked({.step = step, .modulus_mpa = modulus, .surface_triangles = 400});
            if (first == 0.0) first = held.mean;
            EXPECT_NEAR(held.mean, first, 0.01 * first) << "N";
            EXPECT_LT(held.most - held.least, 0.01 * held.mean) << "N";
            EXPECT_LT(held.highest, 1.05 * held.mean) << "N";
            EXPECT_EQ(held.unsettled, 0U);
            EXPECT_LE(held.corrections, 2U);
        }
    }
}

/// Implicit steps damp what a stiff rod excites: the same force and place as Runge-Kutta's, and as steady.
TEST(RodInTissue, ImplicitStepsComeToTheForceOfExplicitOnes) {
    for (const double modulus : {200.0, 2000.0}) {
        const Held wanted = hold_checked({.step = 0.005, .modulus_mpa = modulus});
        for (const double step : {0.002, 0.01, 0.03}) {
            SCOPED_TRACE(fmt::format("{} MPa, steps of {} s", modulus, step));
            const Held held = hold_checked({.step = step, .integrator = "implicit", .modulus_mpa = modulus});
            EXPECT_NEAR(held.mean, wanted.mean, 0.01 * wanted.mean) << "N";
            EXPECT_NEAR(held.tip, wanted.tip, 0.01e-3) << "m";
            EXPECT_LT(held.most, 1.01 * held.mean) << "N";
            EXPECT_GT(held.least, 0.99 * held.mean) << "N";
            EXPECT_LT(held.gap, 0.05 * held.mean) << "N";
        }
    }
}

/// By which stiffness both answer one another decides how fast they agree, not on what.
TEST(RodInTissue, TheStiffnessThatBothAnswerWithChangesNothing) {
    const double wanted = hold_checked({}).mean;
    for (const double wall_stiffness : {0.2, 2.0, 200.0}) {
        SCOPED_TRACE(fmt::format("{} N/mm", wall_stiffness));
        EXPECT_NEAR(hold_checked({.wall_stiffness = wall_stiffness}).mean, wanted, 0.005 * wanted) << "N";
    }
}

} // namespace
} // namespace trocar::engine
