// Rigid links: the dense mesh is embedded in triangles of coarse nodes. At rest vertex p = O + R with O = sum a_i q_i; the frame
// of (q0, q1, q2) turns R, so that |R| never changes: p' = p + w (sum a_i u_i + (A' - A) r), u_i node displacements, r the
// three signed projections of R. Written as displacements, the rest pose is reproduced to the bit wherever it lies.
// This work is based on: Mendoza & O'Sullivan 2005, section 3.1 (weights 1/d, a reading of the paper's lost numerators).
// Deviates: vertices on the same triangle share one frame; embedded vertices take barycentric weights on the face's nearest
// point, continuous across the face, since 1/d weights leave a jump of strain times edge length between neighbours.
#pragma once

#include "base/mesh.hpp"
#include "base/result.hpp"
#include "fem/tissue/force_plan.hpp"

#include <span>

namespace trocar::fem {

/// Vertex v is embedded in frame vertex_frame[v] with weights and projections; vertex_blend 0 leaves it static.
struct RigidLinks {
    std::vector<Triangle> frame_nodes;                // [frame_count] coarse node ids q0, q1, q2
    std::vector<Mat3> frame_rest;                     // [frame_count] columns: unit n, q1 - q0, a at rest
    std::vector<Index> vertex_frame;                  // [vertex_count] kNoIndex: static
    std::vector<std::array<double, 3>> vertex_weight; // [vertex_count] sum to one
    std::vector<Vec3> vertex_projection;              // [vertex_count] m, R on n, q1 - q0, a
    std::vector<double> vertex_blend;                 // [vertex_count] in [0, 1], 0 = static, 1 = moves fully
    std::vector<Vec3> node_rest;                      // [node_count] m, coarse rest positions

    // counts of special cases met while making them
    std::size_t degenerate = 0;   // vertices whose nearest nodes or face were unusable (collinear, thin): a wider choice was taken
    std::size_t static_count = 0; // vertices with blend 0
    double max_length = 0.0;      // m, longest |R| of the vertices that move
    Index longest = kNoIndex;     // the vertex that has it
    std::size_t long_count = 0;   // vertices with |R| above the longest edge of their own link triangle

    [[nodiscard]] std::size_t vertex_count() const noexcept { return vertex_frame.size(); }
};

/// Motion that a link triangle gives its vertices: six columns, their fourth numbers 0.
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

struct SteerReport {
    std::uint32_t collapsed_frames = 0; // triangles without area (or not finite) now: their last good turn is kept
    Index first_collapsed = kNoIndex;

    void note_collapsed(Index frame) noexcept {
        if (collapsed_frames++ == 0) first_collapsed = frame;
    }
};

/// Links every dense vertex to the three nearest coarse surface vertices that are not collinear and belong to the patch
/// around the nearest coarse surface triangle that faces the same way (a thin fold has two sheets: the near one in space
/// need not be the near one in the body). Fails with BadMesh when coarse has no surface triangle of area > 0.
[[nodiscard]] Result<RigidLinks> make_surface_links(const TetMesh& coarse, const TriMesh& dense);

/// Links vertices inside the coarse mesh to the nearest face of the tet that contains them (blend 1). Outside, the blend
/// falls smoothly from 1 on the organ's surface to 0 at blend_length from it; beyond, vertices are static.
/// blend_length [m] >= 0; 0: everything outside is static.
[[nodiscard]] Result<RigidLinks> make_embedded_links(const TetMesh& coarse, std::span<const Vec3> vertices, double blend_length);

/// out[v] = position of dense vertex v, [vertex_count] m. node_position [node_count], rest [vertex_count] the dense mesh's
/// rest positions as given to make_*, out another array. frames is sized on the first call, without allocation later.
SteerReport steer(const RigidLinks& links, std::span<const Vec3> node_position, std::span<const Vec3> rest, LinkFrames& frames,
                  std::span<Vec3> out) noexcept;

/// The two halves of it. A vertex position follows from the frames alone, so that it can be evaluated lazily.
SteerReport turn_frames(const RigidLinks& links, std::span<const Vec3> node_position, LinkFrames& frames) noexcept;
void place_vertices(const RigidLinks& links, const LinkFrames& frames, std::span<const Vec3> rest, std::span<Vec3> out) noexcept;

/// Bytes that one update of the embedded surface reads and writes, every array once.
[[nodiscard]] std::size_t steer_bytes(const RigidLinks& links) noexcept;

/// dp'/dq_i of one vertex, the turn of its frame included. A static vertex has zero blocks on nodes kNoIndex.
struct LinkJacobian {
    Index node[3] = {kNoIndex, kNoIndex, kNoIndex};
    Mat3 block[3] = {Mat3::Zero(), Mat3::Zero(), Mat3::Zero()};
};
[[nodiscard]] LinkJacobian link_jacobian(const RigidLinks& links, Index vertex, std::span<const Vec3> node_position) noexcept;

/// The transpose: a force on the dense vertex as forces on three coarse nodes. Same sum (times the blend) and, for blend 1,
/// same moment about any point.
struct LinkForces {
    Index node[3] = {kNoIndex, kNoIndex, kNoIndex};
    Vec3 force[3] = {Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};
};
[[nodiscard]] LinkForces spread_link_force(const RigidLinks& links, Index vertex, std::span<const Vec3> node_position,
                                           const Vec3& force) noexcept;

} // namespace trocar::fem
