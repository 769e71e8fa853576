// The links of a dense mesh (links.hpp): what is built once, and the frames that change from step to step.
#pragma once

#include "base/mesh.hpp"
#include "fem/tissue/force_plan.hpp"

#include <array>
#include <cstdint>
#include <vector>

namespace trocar::fem {

/// Vertex v follows frame vertex_frame[v] with weights and projections; vertex_blend 0 leaves it static.
struct RigidLinks {
    std::vector<Triangle> frame_nodes;                // [frame_count] coarse node ids q0, q1, q2
    std::vector<Mat3> frame_rest;                     // [frame_count] columns: unit n, q1 - q0, a at rest
    std::vector<Index> vertex_frame;                  // [vertex_count] kNoIndex: static
    std::vector<std::array<double, 3>> vertex_weight; // [vertex_count] sum to one
    std::vector<Vec3> vertex_projection;              // [vertex_count] m, R on n, q1 - q0, a
    std::vector<double> vertex_blend;                 // [vertex_count] in [0, 1], 0 = static, 1 = moves fully
    std::vector<Vec3> node_rest;                      // [node_count] m, coarse rest positions

    // what making them met
    std::size_t degenerate = 0;   // vertices whose nearest nodes or face would not do (collinear, thin): a wider choice was taken
    std::size_t static_count = 0; // vertices with blend 0
    double max_length = 0.0;      // m, longest |R| of the vertices that move
    Index longest = kNoIndex;     // the vertex that has it
    std::size_t long_count = 0;   // vertices with |R| above the longest edge of their own link triangle

    [[nodiscard]] std::size_t vertex_count() const noexcept { return vertex_frame.size(); }
};

/// What a link triangle does to its vertices: six columns, their fourth numbers 0.
struct alignas(64) LinkFrame {
    double displacement[3][4] = {}; // m, of q0, q1, q2
    double turn[3][4] = {};         // A' - A, by column
};

/// What changes from step to step; turns of triangles that collapsed are the last good ones.
struct LinkFrames {
    std::vector<LinkFrame> frame; // [frame_count]
    std::vector<NodeRecord> node; // [node_count] x: position, v: displacement, m
    unsigned threads = 1;         // the bits are the same for any number
    bool leave_static = false;    // static vertices are not written: `out` is one that holds them already
};

struct EmbeddedUpdateReport {
    std::uint32_t collapsed_frames = 0; // triangles without area (or not finite) now: their last good turn is kept
    Index first_collapsed = kNoIndex;

    void note_collapsed(Index frame) noexcept {
        if (collapsed_frames++ == 0) first_collapsed = frame;
    }
};

} // namespace trocar::fem
