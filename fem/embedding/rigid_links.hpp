// The links of a dense mesh (links.hpp): what is built once, and the frames that change from step to step.
#pragma once

#include "base/mesh.hpp"
#include "fem/tissue/force_plan.hpp"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace trocar::fem {

/// Vertex v follows frame vertex_frame[v] with weights and projections; vertex_blend 0 leaves it static. Frames from frame_nodes.size() on are no triangles
/// but affine images of tetrahedra, of one vertex each, with weight (1, 0, 0) and no projection (links.hpp, follow_tets).
struct RigidLinks {
    std::vector<Triangle> frame_nodes;                // [triangle_count] coarse node ids q0, q1, q2
    std::vector<Mat3> frame_rest;                     // [triangle_count] columns: unit n, q1 - q0, a at rest
    std::vector<Index> vertex_frame;                  // [vertex_count] kNoIndex: static
    std::vector<std::array<double, 3>> vertex_weight; // [vertex_count] sum to one
    std::vector<Vec3> vertex_projection;              // [vertex_count] m, R on n, q1 - q0, a
    std::vector<double> vertex_blend;                 // [vertex_count] in [0, 1], 0 = static, 1 = moves fully
    std::vector<Vec3> node_rest;                      // [node_count] m, coarse rest positions
    std::vector<Tet> affine_nodes;                    // [affine_count] coarse node ids
    std::vector<std::array<double, 4>> affine_weight; // [affine_count] sum to one; of a vertex outside of its tetrahedron some are negative

    // what making them met; vertices that follow tetrahedra since (follow_tets) among them, but for the longest
    std::size_t degenerate = 0;   // vertices whose nearest nodes or face would not do (collinear, thin): a wider choice was taken
    std::size_t static_count = 0; // vertices with blend 0
    double max_length = 0.0;      // m, longest |R| of the vertices that move
    Index longest = kNoIndex;     // the vertex that has it
    std::size_t long_count = 0;   // vertices with |R| above the longest edge of their own link triangle

    [[nodiscard]] std::size_t vertex_count() const noexcept { return vertex_frame.size(); }
    [[nodiscard]] std::size_t frame_count() const noexcept { return frame_nodes.size() + affine_nodes.size(); }
    [[nodiscard]] bool is_affine(Index frame) const noexcept { return frame >= frame_nodes.size(); }
    /// Coarse nodes that a frame follows, three or four of them; none: kNoIndex
    [[nodiscard]] std::span<const Index> nodes_of(Index frame) const noexcept {
        if (frame == kNoIndex) return {};
        return is_affine(frame) ? std::span<const Index>(affine_nodes[frame - frame_nodes.size()]) : std::span<const Index>(frame_nodes[frame]);
    }
    /// Weights of these nodes in the place that the vertex is linked to.
    [[nodiscard]] std::span<const double> weights_of(Index vertex) const noexcept {
        const Index frame = vertex_frame[vertex];
        if (frame == kNoIndex) return {};
        return is_affine(frame) ? std::span<const double>(affine_weight[frame - frame_nodes.size()]) : std::span<const double>(vertex_weight[vertex]);
    }
};

/// What a link triangle does to its vertices: six columns, their fourth numbers 0.
struct alignas(64) LinkFrame {
    double displacement[3][4] = {}; // m, of q0, q1, q2
    double turn[3][4] = {};         // A' - A, by column
};

/// What changes from step to step; turns of triangles that collapsed are the last good ones.
struct LinkFrames {
    std::vector<LinkFrame> frame; // [frame_count] of an affine one: its vertex's displacement, 0, 0, and no turn
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
