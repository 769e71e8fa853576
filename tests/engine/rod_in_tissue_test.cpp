// A rod that is far stiffer than the tissue that it presses into: both come to rest, whatever the step.
#include "step_fixture.hpp"

namespace trocar::engine {
namespace {

/// A rod of 200 MPa and 1 mm, pushed 3 mm into the closed end of a channel in a block of 50 kPa, and held.
std::string closed_end(double step) {
    return fmt::format(R"({{
    "name": "closed-end", "units": {{"length": "mm", "pressure": "kPa"}}, "time": {{"step": {}, "duration": 4}}, "budget": "exact",
    "bodies": {{"block": {{"kind": "deformable", "surface": {{"shape": "box", "centre": [0, 0, 30], "extent": [40, 40, 60], "cells": 8}},
            "material": {{"young_modulus": 50, "poisson_ratio": 0.4, "density": 1000, "viscosity": 0.02}},
            "coarse": {{"mesher": "lattice", "surface_triangles": 800}}, "fixed": [{{"box": [[-25, -25, 55], [25, 25, 65]]}}]}},
        "channel": {{"kind": "static", "hollow": true, "embedded_in": "block", "blend": 5, "surface": {{"shape": "tube", "sides": 16,
            "axis": [[0, 0, -10, 2.5], [0, 0, 0, 2.5], [0, 0, 10, 2.5], [0, 0, 20, 2.5], [0, 0, 30, 2.5]]}}}}}},
    "instruments": {{"rod": {{"length": 120, "radius": 1, "young_modulus": 200000, "density": 1100, "segment": 2.5, "skin_triangles": 2000,
        "tip": {{"shape": "straight"}}, "inserted": 30, "friction": 0, "lumen": "channel",
        "entry": {{"position": [0, 0, -5], "direction": [0, 0, 1]}}, "path": [[0, 30, 0], [0.5, 34, 0], [2.5, 37, 0], [10, 37, 0]]}}}},
    "effects": ["elasticity", "damping", "coarse_contact", "exact_contact", "friction"]
}})",
                       step);
}

TEST(RodInTissue, APushIntoAClosedEndComesToTheSameForceAndPlaceAtEveryStep) {
    double first_force = 0.0, first_tip = 0.0;
    struct Case {
        double step, wavers; // s, [-] of the force: at 10 ms tissue and rod still nudge one another
    };
    for (const auto& [step, wavers] : {Case{0.005, 0.05}, Case{0.01, 0.3}, Case{0.002, 0.05}}) {
        const PreparedScene prepared = test::prepare(closed_end(step));
        Simulator simulator(prepared.model);
        const int rests = static_cast<int>(3.0 / step), count = static_cast<int>(4.0 / step);
        double least = INFINITY, most = -INFINITY, sum = 0.0, tip = 0.0;
        for (int k = 0; k < count; ++k) {
            const StepReport& report = simulator.step();
            ASSERT_TRUE(report.finite) << step << ": " << report.failure;
            if (k < rests) continue;
            least = std::min(least, report.handle_force_n);
            most = std::max(most, report.handle_force_n);
            sum += report.handle_force_n;
            tip = report.tip.z();
        }
        const double mean = sum / (count - rests);
        EXPECT_GT(mean, 0.2) << "N at steps of " << step;
        EXPECT_LT(most, (1.0 + wavers) * mean) << "N at steps of " << step;
        EXPECT_GT(least, (1.0 - wavers) * mean) << "N at steps of " << step;
        if (first_force == 0.0) first_force = mean, first_tip = tip;
        EXPECT_NEAR(mean, first_force, 0.05 * first_force) << "N at steps of " << step;
        EXPECT_NEAR(tip, first_tip, 0.02e-3) << "m at steps of " << step;
    }
}

} // namespace
} // namespace trocar::engine
