// `contacts --method image-space`: pairs of triangles that cross, in static meshes.
#pragma once

#include "collision/culling/image_space.hpp"
#include "engine/render/culled_search.hpp"
#include "engine/io/contact_rows.hpp"

namespace trocar::engine {

struct CrossingOptions {
    CullMethod culling = CullMethod::Cpu;
    bool within = true, between = true; // which crossings count, of two meshes
    collision::ImageSpacePlan plan = {};
    bool as_paper = false; // patches at the centres of pixels: loses crossings below a pixel
    ContextOptions contexts = {};
};

struct CrossingAnswer {
    std::vector<ContactRecord> rows;        // kind TT, sorted
    std::size_t triangles = 0, left = 0; // of all meshes; left for the exact tests
    std::vector<collision::ImageSpacePass> passes;
    std::string culler;
    std::vector<std::string> notes;
    Index colours = 0;
    double build_ms = 0.0, cull_ms = 0.0, narrow_ms = 0.0;
};

/// surfaces, positions   one or two; they share no vertices
[[nodiscard]] CrossingAnswer find_crossing_triangles(std::span<const collision::SurfaceTopology> surfaces,
                                                     std::span<const std::vector<Vec3>> positions, const CrossingOptions& options);

} // namespace trocar::engine
