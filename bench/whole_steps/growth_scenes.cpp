#include "bench/whole_steps/growth_scenes.hpp"

#include "assets/anatomy/shapes.hpp"
#include "bench/hard_scenes.hpp"
#include "engine/io/write_mesh.hpp"
#include "fem/mesh/bar_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace trocar::engine {

namespace {

constexpr double kLumen = 0.004, kLumenLength = 0.24; // m
constexpr double kStraight = 0.05, kSway = 0.006, kWave = 0.12; // m, of the lumen: a way in, then bends of 60 mm
constexpr double kCoil = 1.0, kPitch = 0.05;                    // m, of a long lumen: turns that fit into what a scene may measure

/// m, aside, two waves long
double sway_at(double along) noexcept {
    return kSway * (1.0 - std::cos(2.0 * std::numbers::pi * std::clamp(along - kStraight, 0.0, 2.0 * kWave) / kWave));
}

/// The axis of a lumen, which starts along z; a long one goes on in a wide coil.
Vec3 axis_at(double along) noexcept {
    const double turn = along / kCoil;
    return {kCoil * (1.0 - std::cos(turn)) + sway_at(along), kPitch * turn / (2.0 * std::numbers::pi), kCoil * std::sin(turn)};
}

/// A wire that is pushed by a millimetre in each step of 10 ms, through two bends in 1.2 s. Lengths in mm.
std::string wire_text(const std::string& name, const std::string& lumen, double x, double y) {
    return fmt::format(R"("{}": {{"length": 200, "radius": 0.5, "young_modulus": 60000, "segment": 2.5, "skin_triangles": 4000, "lumen": "{}", "inserted": 35,
        "tip": {{"shape": "J", "length": 12, "angle": 0.6}}, "friction": 0.1, "entry": {{"position": [{:.3f}, {:.3f}, 10], "direction": [0, 0, 1]}},
        "limits": {{"speed": 100, "rotation": 15}}, "path": [[0, 35, 0], [1.25, 155, 0.5]]}})",
                       name, lumen, x, y);
}

std::string scene_text(const std::string& bodies, const std::string& instruments, const std::string& effects) {
    return fmt::format(R"({{"name": "growth", "units": {{"length": "mm", "pressure": "kPa"}}, "time": {{"step": 0.01, "duration": 10}}, "budget": "exact",
        "bodies": {{{}}}, "instruments": {{{}}}, "effects": ["coarse_contact", "exact_contact", "friction"{}]}})",
                       bodies, instruments, effects);
}

/// The winding lumen as a tube of a scene, moved aside along y. mm
std::string lumen_text(const std::string& name, double radius, double aside) {
    std::string axis;
    for (double z = 0.0; z <= kLumenLength + 1e-9; z += 0.005)
        axis += fmt::format("{}[{:.6f}, {:.3f}, {:.3f}, {}]", axis.empty() ? "" : ", ", 1e3 * sway_at(z), aside, 1e3 * z, radius);
    return fmt::format(R"("{}": {{"kind": "static", "hollow": true, "surface": {{"shape": "tube", "axis": [{}], "sides": 24}}}})", name, axis);
}

/// Three integers, as equal as they can be, whose product is near this.
std::array<Index, 3> near_cube(double product) noexcept {
    const auto a = static_cast<Index>(std::max(1.0, std::round(std::cbrt(product))));
    const auto b = static_cast<Index>(std::max(1.0, std::round(std::sqrt(product / a))));
    return {a, b, static_cast<Index>(std::max(1.0, std::round(product / a / b)))};
}

std::string ball_text(std::size_t number, double x, double y, double z) {
    return soft_body(fmt::format("ball{}", number),
                     fmt::format(R"({{"shape": "sphere", "centre": [{:.3f}, {:.3f}, {:.3f}], "radius": 10, "subdivisions": 2}})", x, y, z));
}

} // namespace

Result<GrownScene> make_wall_scene(std::size_t triangles, bool finer, const std::filesystem::path& folder) {
    // Triangles about as wide as high: 2 sides x rings of them, rings = length / (circumference / sides).
    const double round = 2.0 * std::numbers::pi * kLumen;
    const int sides = finer ? static_cast<int>(std::lround(std::sqrt(static_cast<double>(triangles) * round / (2.0 * kLumenLength)))) : 24;
    const double cell = round / sides;
    const auto rings = finer ? static_cast<std::size_t>(kLumenLength / cell) + 1 : triangles / (2 * static_cast<std::size_t>(sides));
    std::vector<Vec3> axis;
    for (std::size_t k = 0; k < rings; ++k) axis.push_back(axis_at(cell * static_cast<double>(k)));
    const TriMesh wall = anatomy::make_tube(axis, std::vector<double>(rings, kLumen), sides);
    const auto file = folder / fmt::format("wall_{}.obj", triangles);
    if (auto written = write_obj(file, wall); !written) return written.error();
    return GrownScene{scene_text(fmt::format(R"("lumen": {{"kind": "static", "hollow": true, "surface": {{"file": "{}", "unit": "m"}}}})", file.string()),
                                 wire_text("wire", "lumen", 0.0, 0.0), ""),
                      wall.triangles.size()};
}

Result<GrownScene> make_tissue_scene(std::size_t tets, const std::filesystem::path& folder) {
    const TetMesh mesh = fem::make_bar_mesh(near_cube(static_cast<double>(tets) / 6.0), 0.005, 0.15);
    const auto file = folder / fmt::format("tissue_{}.vtu", tets);
    if (auto written = write_vtu(file, mesh); !written) return written.error();
    return GrownScene{fmt::format(R"({{"name": "growth", "units": {{"length": "mm", "pressure": "kPa"}}, "time": {{"step": 0.01, "duration": 10, "integrator": "leapfrog"}},
        "budget": "exact", "gravity": [1000, 0, -1000],
        "bodies": {{"cube": {{"kind": "deformable", "surface": {{"file": "{0}", "unit": "m"}}, "coarse": {{"file": "{0}", "unit": "m"}},
            "material": {{"law": "neo_hookean", "young_modulus": 8, "poisson_ratio": 0.45, "density": 1060, "viscosity": 0.001, "mass_damping": 5}},
            "fixed": [{{"direction": [0, 0, 1], "fraction": 0.05}}]}}}},
        "effects": ["elasticity", "gravity", "damping"]}})",
                                  file.string()),
                      mesh.tets.size()};
}

GrownScene make_scattered_scene(std::size_t balls) {
    constexpr double kApart = 30.0; // mm
    const auto side = static_cast<std::size_t>(std::ceil(std::cbrt(static_cast<double>(balls)) - 1e-9));
    std::string bodies;
    for (std::size_t k = 0; k < balls; ++k)
        bodies += ball_text(k, kApart * static_cast<double>(k % side), kApart * static_cast<double>(k / side % side), kApart * static_cast<double>(k / side / side));
    return {solid_scene({.bodies = bodies, .table = false}), balls};
}

GrownScene make_heap_scene(std::size_t balls) {
    constexpr double kApart = 20.5, kLayer = 17.0; // mm
    const auto side = static_cast<std::size_t>(std::ceil(std::cbrt(static_cast<double>(balls)) - 1e-9));
    const double half = 0.5 * (kApart * static_cast<double>(side) + 0.5 * kApart); // every second layer is shifted by a quarter, either way
    std::string bodies;
    for (std::size_t k = 0; k < balls; ++k) {
        const std::size_t layer = k / (side * side), row = k / side % side, column = k % side;
        const double shift = layer % 2 == 0 ? -0.25 * kApart : 0.25 * kApart, middle = 0.5 * static_cast<double>(side - 1);
        bodies += ball_text(k, kApart * (static_cast<double>(column) - middle) + shift, kApart * (static_cast<double>(row) - middle) + shift,
                            11.0 + kLayer * static_cast<double>(layer));
    }
    for (int k = 0; k < 4; ++k) {
        const double away = (k % 2 == 0 ? 1.0 : -1.0) * (half + 5.0), length = 2.0 * half + 20.0;
        const bool along_x = k < 2;
        bodies += fmt::format(R"("wall{}": {{"kind": "static", "surface": {{"shape": "box", "centre": [{}, {}, 45], "extent": [{}, {}, 100], "cells": 6}}}}, )",
                              k, along_x ? away : 0.0, along_x ? 0.0 : away, along_x ? 10.0 : length, along_x ? length : 10.0);
    }
    return {solid_scene({.bodies = bodies}), balls};
}

GrownScene make_instruments_scene(std::size_t wires, bool in_one_lumen) {
    std::string bodies, instruments;
    if (in_one_lumen) bodies = lumen_text("lumen", 6.0, 0.0);
    for (std::size_t k = 0; k < wires; ++k) {
        const double aside = 20.0 * static_cast<double>(k), angle = 2.0 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(std::max<std::size_t>(wires, 1));
        if (!in_one_lumen) bodies += (k > 0 ? ", " : "") + lumen_text(fmt::format("lumen{}", k), 4.0, aside);
        const std::string lumen = in_one_lumen ? "lumen" : fmt::format("lumen{}", k);
        instruments += (k > 0 ? ", " : "") + wire_text(fmt::format("wire{}", k), lumen, in_one_lumen ? 3.0 * std::cos(angle) : 0.0, in_one_lumen ? 3.0 * std::sin(angle) : aside);
    }
    return {scene_text(bodies, instruments, in_one_lumen ? R"(, "instrument_contact")" : ""), wires};
}

} // namespace trocar::engine
