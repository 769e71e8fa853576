// A rod that is far stiffer than the tissue that it presses into: both come to rest, whatever the step.
#include "step_fixture.hpp"

namespace trocar::engine {
namespace {

/// A rod of 1 mm, pushed 3 mm into the closed end of a channel in a block of 50 kPa, and held.
std::string closed_end(double step, double modulus_mpa) {
    return fmt::format(R"({{
    "name": "closed-end", "units": {{"length": "mm", "pressure": "kPa"}}, "time": {{"step": {}, "duration": 4}}, "budget": "exact",
    "bodies": {{"block": {{"kind": "deformable", "surface": {{"shape": "box", "centre": [0, 0, 30], "extent": [40, 40, 60], "cells": 8}},
            "material": {{"young_modulus": 50, "poisson_ratio": 0.4, "density": 1000, "viscosity": 0.02}},
            "coarse": {{"mesher": "lattice", "surface_triangles": 800}}, "fixed": [{{"box": [[-25, -25, 55], [25, 25, 65]]}}]}},
        "channel": {{"kind": "static", "hollow": true, "embedded_in": "block", "blend": 5, "surface": {{"shape": "tube", "sides": 16,
            "axis": [[0, 0, -10, 2.5], [0, 0, 0, 2.5], [0, 0, 10, 2.5], [0, 0, 20, 2.5], [0, 0, 30, 2.5]]}}}}}},
    "instruments": {{"rod": {{"length": 120, "radius": 1, "young_modulus": {}000, "density": 1100, "segment": 2.5, "skin_triangles": 2000,
        "tip": {{"shape": "straight"}}, "inserted": 30, "friction": 0, "lumen": "channel",
        "entry": {{"position": [0, 0, -5], "direction": [0, 0, 1]}}, "path": [[0, 30, 0], [0.5, 34, 0], [2.5, 37, 0], [10, 37, 0]]}}}},
    "effects": ["elasticity", "damping", "coarse_contact", "exact_contact", "friction"]
}})",
                       step, modulus_mpa);
}

/// What the last of four seconds come to.
struct Held {
    double least = INFINITY, most = -INFINITY, mean = 0.0, tip = 0.0; // N, N, N, m
};

Held hold(double step, double modulus_mpa) {
    const PreparedScene prepared = test::prepare(closed_end(step, modulus_mpa));
    Simulator simulator(prepared.model);
    const int rests = static_cast<int>(3.0 / step), count = static_cast<int>(4.0 / step);
    Held held;
    for (int k = 0; k < count; ++k) {
        const StepReport& report = simulator.step();
        EXPECT_TRUE(report.finite) << report.failure;
        if (!report.finite) return held;
        if (k < rests) continue;
        held.least = std::min(held.least, report.handle_force_n);
        held.most = std::max(held.most, report.handle_force_n);
        held.mean += report.handle_force_n / (count - rests);
        held.tip = report.tip.z();
    }
    return held;
}

TEST(RodInTissue, APushIntoAClosedEndComesToTheSameForceAndPlaceAtEveryStep) {
    Held first;
    for (const double step : {0.005, 0.01, 0.002}) {
        SCOPED_TRACE(fmt::format("steps of {} s", step));
        const Held held = hold(step, 200);
        if (step == 0.005) first = held;
        EXPECT_GT(held.mean, 0.2) << "N";
        EXPECT_LT(held.most, 1.05 * held.mean) << "N";
        EXPECT_GT(held.least, 0.95 * held.mean) << "N";
        EXPECT_NEAR(held.mean, first.mean, 0.05 * first.mean) << "N";
        EXPECT_NEAR(held.tip, first.tip, 0.02e-3) << "m";
    }
}

/// Stiffer than what the tissue's spring may be (contact.wall_stiffness): it wavers, and neither is thrown.
TEST(RodInTissue, APushByARodBeyondTheSpringsStiffnessThrowsNeither) {
    const double softer = hold(0.005, 200).mean;
    for (const double step : {0.002, 0.005, 0.01}) {
        SCOPED_TRACE(fmt::format("steps of {} s", step));
        const Held held = hold(step, 2000);
        EXPECT_GT(held.least, 0.0) << "N";
        EXPECT_LT(held.most, 3.0 * softer) << "N";
        EXPECT_NEAR(held.mean, softer, 0.1 * softer) << "N";
        EXPECT_NEAR(held.tip, 0.032, 0.02e-3) << "m";
    }
}

} // namespace
} // namespace trocar::engine
