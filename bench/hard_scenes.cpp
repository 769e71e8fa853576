#include "bench/hard_scenes.hpp"

#include <algorithm>
#include <limits>

namespace trocar::engine {

std::optional<PreparedScene> prepare_hard_scene(HardReport& report, const std::string& text) {
    const Result<Scene> scene = parse_scene(text, "hard_case.json");
    if (!report.require(scene.ok(), scene.ok() ? "" : scene.error().to_string())) return std::nullopt;
    Result<PreparedScene> prepared = make_prepared_scene(*scene);
    if (!report.require(prepared.ok(), prepared.ok() ? "" : prepared.error().to_string())) return std::nullopt;
    return std::move(*prepared);
}

std::string tube_scene(const StraightTube& tube) {
    std::string axis;
    const auto add = [&](double x, double z) { axis += fmt::format("{}[{}, 0, {}, 3]", axis.empty() ? "" : ", ", tube.away + x, z); };
    add(0, 0), add(0, 50);
    if (tube.bent)
        add(5, 70), add(20, 85), add(40, 90), add(80, 90);
    else
        add(0, 100);
    return fmt::format(R"({{
    "name": "tube", "units": {{"length": "mm", "pressure": "kPa"}}, "time": {{"step": 0.01, "duration": 2}}, "budget": "{}",
    "bodies": {{"tube": {{"kind": "static", "hollow": true, "surface": {{"shape": "tube", "axis": [{}], "sides": 20}}}}}},
    "instruments": {{"wire": {{"length": 240, "radius": 0.5, "young_modulus": 60000, "segment": 2.5, "skin_triangles": 1500,
        "tip": {{"shape": "straight"}}, "lumen": "tube", "entry": {{"position": [{}, 0, 10], "direction": [0, 0, 1]}},
        "limits": {{"speed": {}, "rotation": 31.4}}, "path": [[0, {}, 0], [{:.9f}, {}, 0]]}}}},
    "effects": [{}]
}})",
                       tube.budget, axis, tube.away, tube.speed, tube.from, 1.001 * (tube.to - tube.from) / tube.speed, tube.to,
                       tube.effects);
}

std::string organ_scene(const std::string& budget) {
    return fmt::format(R"({{
    "name": "organ", "units": {{"length": "mm", "pressure": "kPa"}}, "time": {{"step": 0.01, "duration": 0.6}}, "budget": "{}",
    "bodies": {{
        "organ": {{"kind": "deformable", "surface": {{"shape": "box", "centre": [10, 0, 60], "extent": [60, 40, 60], "cells": 4}},
            "material": {{"young_modulus": 5, "poisson_ratio": 0.4, "density": 1000, "viscosity": 0.001, "mass_damping": 5}},
            "coarse": {{"surface_triangles": 120}}, "fixed": [{{"direction": [0, 1, 0], "fraction": 0.1}}]}},
        "tube": {{"kind": "static", "hollow": true, "embedded_in": "organ", "blend": 5, "surface": {{"shape": "tube", "sides": 20,
            "axis": [[0, 0, 0, 3], [0, 0, 50, 3], [5, 0, 70, 3], [20, 0, 85, 3], [40, 0, 90, 3], [80, 0, 90, 3]]}}}}}},
    "instruments": {{"wire": {{"length": 240, "radius": 0.5, "young_modulus": 60000, "segment": 2.5, "skin_triangles": 1500,
        "tip": {{"shape": "J", "length": 12, "angle": 0.8}}, "lumen": "tube",
        "entry": {{"position": [0, 0, 10], "direction": [0, 0, 1]}}, "limits": {{"speed": 150, "rotation": 15}},
        "path": [[0, 20, 0], [0.6, 100, 2]]}}}},
    "effects": ["elasticity", "damping", "coarse_contact", "exact_contact", "friction"]
}})",
                       budget);
}

std::string solid_scene(const SolidScene& scene) {
    const std::string table = fmt::format(
        R"("table": {{"kind": "static", "surface": {{"shape": "box", "centre": [{}, 0, -5], "extent": [120, 120, 10], "cells": 24}}}})",
        scene.away);
    std::string bodies = scene.bodies;
    if (scene.table)
        bodies += table;
    else
        bodies.resize(bodies.find_last_of('}') + 1); // no comma behind the last
    return fmt::format(R"({{"name": "solids", "units": {{"length": "mm", "pressure": "kPa"}}, "time": {{"step": {}, "duration": 10}},
        "budget": "{}", {}"bodies": {{{}}}, "contact": {{{}}},
        "effects": ["elasticity", {}"damping", "coarse_contact", "friction"]}})",
                       scene.step, scene.budget, scene.gravity ? "\"gravity\": [0, 0, -9810], " : "", bodies, scene.contact,
                       scene.gravity ? "\"gravity\", " : "");
}

std::string soft_body(const std::string& name, const std::string& surface, int triangles) {
    return fmt::format(R"("{}": {{"kind": "deformable", "surface": {},
        "material": {{"young_modulus": 30, "poisson_ratio": 0.4, "density": 1000, "viscosity": 0.005, "mass_damping": 2}},
        "coarse": {{"mesher": "lattice", "surface_triangles": {}}}}}, )",
                       name, surface, triangles);
}

std::string heap_bodies(int balls, int triangles) {
    std::string bodies;
    int made = 0;
    for (int layer = 0; made < balls; ++layer) {
        const int side = layer % 2 == 0 ? 3 : 2;
        for (int i = 0; i < side * side && made < balls; ++i, ++made)
            bodies +=
                soft_body(fmt::format("ball{}", made),
                          fmt::format(R"({{"shape": "sphere", "centre": [{}, {}, {}], "radius": 10, "subdivisions": 2}})",
                                      21.0 * (i % side - 0.5 * (side - 1)), 21.0 * (i / side - 0.5 * (side - 1)), 11.0 + 17.0 * layer),
                          triangles);
    }
    for (int k = 0; k < 4; ++k) {
        const double away = k % 2 == 0 ? 37.5 : -37.5;
        const bool along_x = k < 2;
        bodies += fmt::format(
            R"("wall{}": {{"kind": "static", "surface": {{"shape": "box", "centre": [{}, {}, 30], "extent": [{}, {}, 80], "cells": 6}}}}, )",
            k, along_x ? away : 0.0, along_x ? 0.0 : away, along_x ? 10 : 90, along_x ? 90 : 10);
    }
    return bodies;
}

double energy_of(Simulator& simulator) {
    double potential = 0.0;
    for (std::size_t i = 0; i < simulator.model().bodies.size(); ++i) {
        if (!simulator.model().bodies[i].tissue || !simulator.model().effects.gravity) continue;
        const fem::TissueModel& tissue = *simulator.model().bodies[i].tissue;
        const Vec3 up = -*simulator.model().effects.gravity;
        for (std::size_t n = 0; n < tissue.node_count(); ++n)
            potential += tissue.node_mass[n] * up.dot(simulator.state().bodies[i].tissue.position[n]);
    }
    return potential + simulator.report().kinetic_j + simulator.report().elastic_j;
}

Vec3 middle_of(const std::vector<Vec3>& points) {
    Vec3 sum = Vec3::Zero();
    for (const Vec3& p : points) sum += p;
    return sum / static_cast<double>(points.size());
}

double lowest_of(const std::vector<Vec3>& points) {
    double z = std::numeric_limits<double>::infinity();
    for (const Vec3& p : points) z = std::min(z, p.z());
    return z;
}

bool all_finite(const State& state) {
    const auto finite = [](const std::vector<Vec3>& list) {
        return std::all_of(list.begin(), list.end(), [](const Vec3& v) { return is_finite(v); });
    };
    for (const BodyState& body : state.bodies)
        if (!finite(body.surface) || !finite(body.tissue.position) || !finite(body.tissue.velocity)) return false;
    return std::all_of(state.instruments.begin(), state.instruments.end(),
                       [&](const InstrumentState& i) { return finite(i.rod.position) && finite(i.rod.velocity) && finite(i.skin); });
}

} // namespace trocar::engine
