// Small scenes for the step: a wire in a bent tube, a ball over a table, a bar that is held at one end.
#pragma once

#include "engine/prepare/prepare_scene.hpp"
#include "engine/state/state.hpp"
#include "engine/step/simulator.hpp"
#include "engine/step/stages.hpp"
#include "engine/step/tissue/tissue_stage.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include <cmath>
#include <random>
#include <string>

namespace trocar::engine {

/// Looks into a simulator, for tests of one stage.
struct ScratchView {
    [[nodiscard]] static StepScratch& of(Simulator& simulator) { return simulator.scratch(); }
};

} // namespace trocar::engine

namespace trocar::engine::test {

/// Random numbers and attitudes from a printed seed.
struct Random {
    std::mt19937_64 engine;
    explicit Random(unsigned seed) : engine(seed) {}
    double between(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine); }
    bool coin() { return between(0.0, 1.0) < 0.5; }
    Vec3 direction() {
        std::normal_distribution<double> normal;
        return Vec3(normal(engine), normal(engine), normal(engine)).normalized();
    }
    Mat3 turn() { return Eigen::AngleAxisd(between(0.0, 6.28), direction()).toRotationMatrix(); }
    /// s, 0.2 to 10 ms
    double step() { return std::pow(10.0, between(-3.7, -2.0)); }
};

/// An empty model, and a failed test, when the text is refused.
inline PreparedScene prepare(const std::string& text) {
    Result<Scene> scene = parse_scene(text, "scenes/step.json");
    EXPECT_TRUE(scene.ok()) << (scene.ok() ? "" : scene.error().to_string());
    if (!scene.ok()) return {};
    Result<PreparedScene> prepared = make_prepared_scene(*scene);
    EXPECT_TRUE(prepared.ok()) << (prepared.ok() ? "" : prepared.error().to_string());
    return prepared.ok() ? std::move(*prepared) : PreparedScene{};
}

/// Rows of a tube: 50 mm up, a quarter circle of `bend_radius` mm to the side, 60 mm on.
inline std::string bent_axis(double bend_radius, double radius) {
    std::string rows = fmt::format("[0, 0, 0, {0}], [0, 0, 50, {0}]", radius);
    constexpr int kParts = 12;
    for (int i = 1; i <= kParts; ++i) {
        const double angle = 0.5 * 3.14159265358979 * i / kParts;
        rows +=
            fmt::format(", [{:.9f}, 0, {:.9f}, {}]", bend_radius * (1.0 - std::cos(angle)), 50.0 + bend_radius * std::sin(angle), radius);
    }
    return rows + fmt::format(", [{}, 0, {}, {}]", bend_radius + 60.0, 50.0 + bend_radius, radius);
}

struct BentTube {
    double speed = 35.0; // mm/s, of the drive command
    std::string budget = "exact";
    std::string effects = R"("coarse_contact", "exact_contact", "friction")";
    std::string host_body = {}; // further bodies; embeds the tube in "organ" when not empty
    std::string integrator = "rk4";
};

/// A wire of 0.5 mm is pushed 120 mm into a tube of 3 mm, through the bend, turning on its way.
inline std::string bent_tube_scene(const BentTube& options = {}) {
    const double time = 120.1 / options.speed; // s, just within the drive's limit
    return fmt::format(R"({{
    "name": "bent-tube",
    "units": {{"length": "mm", "pressure": "kPa"}},
    "time": {{"step": 0.01, "duration": {time:.6f}, "integrator": "{integrator}"}},
    "budget": "{budget}",
    "bodies": {{
        {carrier}
        "tube": {{"kind": "static", "hollow": true{embedded},
                 "surface": {{"shape": "tube", "axis": [{axis}], "sides": 20}}}}
    }},
    "instruments": {{"wire": {{"length": 220, "radius": 0.5, "young_modulus": 60000, "segment": 2.5, "skin_triangles": 1500,
        "tip": {{"shape": "J", "length": 12, "angle": 0.8}}, "lumen": "tube",
        "entry": {{"position": [0, 0, 10], "direction": [0, 0, 1]}},
        "limits": {{"speed": {speed}, "rotation": {turn}}},
        "path": [[0, 20, 0], [{time:.6f}, 140, 2]]}}}},
    "effects": [{effects}]
}})",
                       fmt::arg("time", time), fmt::arg("integrator", options.integrator), fmt::arg("budget", options.budget), fmt::arg("carrier", options.host_body),
                       fmt::arg("embedded", options.host_body.empty() ? "" : R"(, "embedded_in": "organ", "blend": 5)"),
                       fmt::arg("axis", bent_axis(25.0, 3.0)), fmt::arg("speed", options.speed),
                       fmt::arg("turn", 3.14 * options.speed / 35.0), fmt::arg("effects", options.effects));
}

/// Tissue round the tube's bend, held at its far side.
inline const std::string kOrgan = R"("organ": {"kind": "deformable",
        "surface": {"shape": "box", "centre": [10, 0, 60], "extent": [60, 40, 60], "cells": 4},
        "material": {"young_modulus": 5, "poisson_ratio": 0.4, "density": 1000, "viscosity": 0.001, "mass_damping": 5},
        "coarse": {"surface_triangles": 120}, "fixed": [{"direction": [0, 1, 0], "fraction": 0.1}]},)";

/// Result of a run: sums and extremes over its steps.
struct Tally {
    std::uint64_t steps = 0, lumen_exits = 0, exact_steps = 0, forced_exact = 0, assumed = 0, open = 0, unproven = 0, scaled_step_count = 0;
    std::uint64_t pairs_tested = 0, candidates = 0;
    double largest_force = 0.0, insertion = 0.0, largest_energy = 0.0;
    StepReport last;
};

inline std::ostream& operator<<(std::ostream& os, const Tally& t) {
    return os << t.steps << " steps, " << t.exact_steps << " exact, " << t.scaled_step_count << " scaled, " << t.lumen_exits << " lumen exits, "
              << t.open << " open pairs, " << t.assumed << " assumed, " << t.unproven << " unproven links, inserted " << 1e3 * t.insertion
              << " mm, " << t.largest_force << " N; " << t.last.failure;
}

inline Tally run_steps(Simulator& simulator, std::uint64_t steps) {
    Tally tally;
    for (std::uint64_t k = 0; k < steps; ++k) {
        const StepReport& report = simulator.step();
        tally.last = report;
        if (!report.finite) break;
        ++tally.steps;
        tally.lumen_exits += report.lumen_exits;
        tally.exact_steps += report.exact_ran;
        tally.forced_exact += report.exact_forced;
        tally.assumed += report.assumed;
        tally.open += report.pairs_open;
        tally.unproven += report.unproven_links;
        tally.scaled_step_count += report.safe_fraction < 1.0;
        tally.pairs_tested += report.pairs_tested;
        tally.candidates += report.candidates;
        tally.largest_force = std::max(tally.largest_force, report.contact_force_n);
        tally.largest_energy = std::max(tally.largest_energy, report.kinetic_j + report.elastic_j);
        tally.insertion = report.insertion_m;
    }
    return tally;
}

/// The start of a step for tests that move the surfaces themselves.
inline void keep_whole_start(const SceneModel& model, State& state, StepScratch& scratch) {
    keep_start(model, state, scratch.bodies, scratch.solids, scratch.rods);
    for (std::size_t i = 0; i < model.bodies.size(); ++i) {
        if (model.bodies[i].moves()) scratch.bodies.start[i].surface = state.bodies[i].surface;
        scratch.rods.walls[i].surface_t0 = scratch.bodies.start[i].surface;
    }
}

inline bool all_finite(const State& state) {
    const auto finite = [](const std::vector<Vec3>& list) {
        for (const Vec3& v : list)
            if (!v.allFinite()) return false;
        return true;
    };
    for (const BodyState& body : state.bodies)
        if (!finite(body.surface) || !finite(body.tissue.position) || !finite(body.tissue.velocity)) return false;
    for (const InstrumentState& instrument : state.instruments)
        if (!finite(instrument.rod.position) || !finite(instrument.rod.velocity) || !finite(instrument.skin)) return false;
    return true;
}

} // namespace trocar::engine::test
