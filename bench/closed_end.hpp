// A rod that presses into tissue: the scene by which a law of contact is measured, and held by tests.
#pragma once

#include "engine/prepare/prepare_scene.hpp"

#include <cstdint>
#include <string>

namespace trocar::engine {

/// Throws where the scene cannot be read or prepared.
[[nodiscard]] PreparedScene prepare_law_text(const std::string& text);

/// A rod of 1 mm, pushed 3 mm into the closed end of a channel in a block of tissue, and held for a second.
struct ClosedEnd {
    double step = 0.01;         // s
    std::string integrator = "rk4";
    double modulus_mpa = 200.0; // of the rod
    double wall_stiffness = 20.0; // N/mm
    double tissue_kpa = 50.0;
    int surface_triangles = 800; // of the tissue's mesh: 800 are finer than the channel, 400 coarser
};

/// What the last of four seconds come to, and the push before them.
struct Held {
    bool finite = true;
    double least = 0.0, most = 0.0, mean = 0.0, tip = 0.0; // N, N, N, m
    double highest = 0.0;                                  // N, of all steps
    double gap = 0.0;                                      // N, the largest of the last ones
    std::uint64_t unsettled = 0, corrections = 0;
};

[[nodiscard]] Held hold(const ClosedEnd& scene);

} // namespace trocar::engine
