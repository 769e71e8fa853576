#include "bench/closed_end.hpp"

#include "engine/step/simulator.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace trocar::engine {

namespace {

std::string text_of(const ClosedEnd& s) {
    return fmt::format(R"({{
    "name": "closed-end", "units": {{"length": "mm", "pressure": "kPa"}}, "time": {{"step": {}, "duration": 4, "integrator": "{}"}}, "budget": "exact",
    "contact": {{"wall_stiffness": {}}},
    "bodies": {{"block": {{"kind": "deformable", "surface": {{"shape": "box", "centre": [0, 0, 30], "extent": [40, 40, 60], "cells": 8}},
            "material": {{"young_modulus": {}, "poisson_ratio": 0.4, "density": 1000, "viscosity": 0.02}},
            "coarse": {{"mesher": "lattice", "surface_triangles": {}}}, "fixed": [{{"box": [[-25, -25, 55], [25, 25, 65]]}}]}},
        "channel": {{"kind": "static", "hollow": true, "embedded_in": "block", "blend": 5, "surface": {{"shape": "tube", "sides": 16,
            "axis": [[0, 0, -10, 2.5], [0, 0, 0, 2.5], [0, 0, 10, 2.5], [0, 0, 20, 2.5], [0, 0, 30, 2.5]]}}}}}},
    "instruments": {{"rod": {{"length": 120, "radius": 1, "young_modulus": {}000, "density": 1100, "segment": 2.5, "skin_triangles": 2000,
        "tip": {{"shape": "straight"}}, "inserted": 30, "friction": 0, "lumen": "channel",
        "entry": {{"position": [0, 0, -5], "direction": [0, 0, 1]}}, "path": [[0, 30, 0], [0.5, 34, 0], [2.5, 37, 0], [10, 37, 0]]}}}},
    "effects": ["elasticity", "damping", "coarse_contact", "exact_contact", "friction"]
}})",
                       s.step, s.integrator, s.wall_stiffness, s.tissue_kpa, s.surface_triangles, s.modulus_mpa);
}

} // namespace

PreparedScene prepare_law_text(const std::string& text) {
    const Result<Scene> scene = parse_scene(text, "laws.json");
    if (!scene.ok()) throw std::runtime_error(scene.error().to_string());
    Result<PreparedScene> prepared = make_prepared_scene(*scene);
    if (!prepared.ok()) throw std::runtime_error(prepared.error().to_string());
    return std::move(*prepared);
}

Held hold(const ClosedEnd& scene) {
    const PreparedScene prepared = prepare_law_text(text_of(scene));
    Simulator simulator(prepared.model);
    const int rests = static_cast<int>(3.0 / scene.step), count = static_cast<int>(4.0 / scene.step);
    Held held{.least = std::numeric_limits<double>::infinity(), .most = -std::numeric_limits<double>::infinity()};
    for (int k = 0; k < count; ++k) {
        const StepReport& report = simulator.step();
        held.finite = report.finite;
        if (!report.finite) {
            held.mean = held.tip = std::numeric_limits<double>::quiet_NaN(); // holds no law
            return held;
        }
        held.highest = std::max(held.highest, report.handle_force_n);
        held.unsettled += report.unsettled_rods;
        held.corrections += report.corrections;
        if (k < rests) continue;
        held.least = std::min(held.least, report.handle_force_n);
        held.most = std::max(held.most, report.handle_force_n);
        held.gap = std::max(held.gap, report.exchange_gap_n);
        held.mean += report.handle_force_n / (count - rests);
        held.tip = report.tip.z();
    }
    return held;
}

} // namespace trocar::engine
