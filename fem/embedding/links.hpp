// Rigid links: the dense mesh is embedded in triangles of coarse nodes. At rest vertex p = O + R with O = sum a_i q_i; the frame
// of (q0, q1, q2) turns R, so that |R| never changes: p' = p + w (sum a_i u_i + (A' - A) r), u_i node displacements, r the
// three signed projections of R. Written as displacements, the rest pose is reproduced to the bit wherever it lies.
// This work is based on: Mendoza & O'Sullivan 2005, section 3.1 (weights 1/d, a reading of the paper's lost numerators).
// Deviates: vertices on the same triangle share one frame; embedded vertices take barycentric weights on the face's nearest
// point, continuous across the face, since 1/d weights leave a jump of strain times edge length between neighbours.
#pragma once

#include "base/mesh.hpp"
#include "base/result.hpp"
#include "fem/embedding/rigid_links.hpp"

#include <span>

namespace trocar::fem {

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
EmbeddedUpdateReport update_embedded_surface(const RigidLinks& links, std::span<const Vec3> node_position, std::span<const Vec3> rest, LinkFrames& frames,
                  std::span<Vec3> out) noexcept;

/// The two halves of it. A vertex position follows from the frames alone, so that it can be evaluated lazily.
EmbeddedUpdateReport turn_frames(const RigidLinks& links, std::span<const Vec3> node_position, LinkFrames& frames) noexcept;
void place_vertices(const RigidLinks& links, const LinkFrames& frames, std::span<const Vec3> rest, std::span<Vec3> out) noexcept;

/// Bytes that one update of the embedded surface reads and writes, every array once.
[[nodiscard]] std::size_t embedded_update_bytes(const RigidLinks& links) noexcept;

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
