// A block on a slope: held as long as the slope is below the friction angle, and beyond it as fast as Coulomb's law lets it slide.
#include "bench/hard_scenes.hpp"

#include <cmath>

namespace trocar::engine {

namespace {

struct Slope {
    double friction = 0.5;
    double steepness = 0.8; // tangent of the slope over mu
    double stiffness = 0.2; // N/mm, of a place that touches
    double step = 0.005;    // s
};

/// The table lies level and gravity is tilted.
std::string slope_scene(const Slope& s) {
    const double tangent = s.friction * s.steepness, cosine = 1.0 / std::sqrt(1.0 + tangent * tangent);
    return fmt::format(R"({{"name": "slope", "units": {{"length": "mm", "pressure": "kPa"}}, "time": {{"step": {}, "duration": 10}},
        "budget": "exact", "gravity": [{}, 0, {}], "contact": {{"solid_friction": {}, "solid_stiffness": {}}}, "bodies": {{
        "block": {{"kind": "deformable", "surface": {{"shape": "box", "centre": [0, 0, 10], "extent": [40, 40, 20], "cells": 8}},
            "material": {{"young_modulus": 50, "poisson_ratio": 0.4, "density": 1000, "viscosity": 0.01}},
            "coarse": {{"mesher": "lattice", "surface_triangles": 150}}}},
        "table": {{"kind": "static", "surface": {{"shape": "box", "centre": [0, 0, -5], "extent": [1600, 400, 10], "cells": 20}}}}}},
        "effects": ["elasticity", "damping", "gravity", "coarse_contact", "friction"]}})",
                       s.step, 9810.0 * tangent * cosine, -9810.0 * cosine, s.friction, s.stiffness);
}

/// m; how far it went along the slope in a second, and in the last fifth of it.
struct Slid {
    double all = NAN, last = NAN;
};

Slid slide(HardReport& report, const Slope& s) {
    Slid slid;
    const auto prepared = prepare_hard_scene(report, slope_scene(s));
    if (!prepared) return slid;
    Simulator simulator(prepared->model);
    const auto steps = static_cast<std::uint64_t>(std::lround(1.0 / s.step));
    const double start = middle_of(simulator.state().bodies[0].surface).x();
    double before = start;
    const bool ran = run_hard(report, simulator, steps, [&](const StepReport& step) {
        if (step.step == steps - steps / 5) before = middle_of(simulator.state().bodies[0].surface).x();
    });
    const double end = middle_of(simulator.state().bodies[0].surface).x();
    return ran ? Slid{end - start, end - before} : slid;
}

/// m; in a second, by Coulomb's law.
double way_of(const Slope& s) {
    const double tangent = s.friction * s.steepness;
    return 0.5 * 9.81 * (tangent - s.friction) / std::sqrt(1.0 + tangent * tangent);
}

std::string name_of(const Slope& s) {
    return fmt::format("block on a slope of {:g} mu, mu {:g}, {:g} N/mm, step {:g} ms", s.steepness, s.friction, s.stiffness, 1e3 * s.step);
}

void a_block_on_a_slope_is_held(HardReport& report) {
    for (const double steepness : {0.3, 0.8})
        for (const Slope& s : {Slope{0.5, steepness}, {0.5, steepness, 20.0}, {0.5, steepness, 0.2, 0.001}, {0.3, steepness}}) {
            const Slid slid = slide(report, s);
            report.below(name_of(s) + ": how far it goes until it is held", slid.all, 2e-3, "m"); // its springs, and its own shear
            report.below(name_of(s) + ": in the last fifth of the second", std::abs(slid.last), 1e-5, "m");
        }
}

void a_block_beyond_the_friction_angle_slides(HardReport& report) {
    for (const double steepness : {1.05, 1.3})
        for (const Slope& s : {Slope{0.5, steepness},
                               {0.5, steepness, 2.0},
                               {0.5, steepness, 0.2, 0.001},
                               {0.5, steepness, 20.0, 0.001},
                               {0.3, steepness}}) {
            const double share = slide(report, s).all / way_of(s);
            const double off = s.steepness < 1.1 ? 0.3 : 0.05; // what drives it is a twentieth of what holds it
            report.above(name_of(s) + ": its way over Coulomb's", share, 1.0 - off);
            report.below(name_of(s) + ": the same", share, 1.0 + off);
        }
    const Slope stiff{0.5, 1.3, 20.0}; // for its step: it hops, and may catch
    report.note(fmt::format("{}: its way over Coulomb's {:.2f}", name_of(stiff), slide(report, stiff).all / way_of(stiff)));
}

constexpr HardCase kSlopesCases[] = {
    {"contact", "ABlockBelowTheFrictionAngleIsHeld",
     "at 0.3 and 0.8 of the angle, by springs of 0.2 and 20 N/mm, in steps of 1 and 5 ms: it stops within 2 mm, and stays",
     a_block_on_a_slope_is_held},
    {"contact", "ABlockBeyondTheFrictionAngleSlidesAsCoulombHasIt",
     "at 1.3 of the angle its way within 0.05 of the law's; at 1.05, where a hundredth of its friction is a fifth of its way, within 0.3",
     a_block_beyond_the_friction_angle_slides},
};

} // namespace

std::span<const HardCase> hard_slopes() noexcept { return kSlopesCases; }

} // namespace trocar::engine
