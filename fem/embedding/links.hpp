// Rigid links: the dense mesh is embedded in triangles of coarse nodes. At rest vertex p = O + R with O = sum a_i q_i; the frame
// of (q0, q1, q2) turns R, so that |R| never changes: p' = p + w (sum a_i u_i + (A' - A) r), u_i node displacements, r the
// three signed projections of R. Written as displacements, the rest pose is reproduced to the bit wherever it lies.
// This work is based on: Mendoza & O'Sullivan 2005, section 3.1 (weights 1/d, a reading of the paper's lost numerators).
// Deviates: sharp vertices may follow a tetrahedron instead (follow_tets); vertices on the same triangle share one frame; embedded
// vertices take barycentric weights on the face's nearest point, continuous across the face, since 1/d weights leave a jump of strain times edge length between neighbours.
#pragma once

#include "base/mesh.hpp"
#include "base/result.hpp"
#include "fem/embedding/rigid_links.hpp"

#include <algorithm>
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

/// Links a lumen's surface to the bore of the wall around it: barycentric coordinates on the nearest boundary triangle that faces into the lumen (of another
/// branch's wall that lies across it no triangle does, near enough); all vertices move fully.
[[nodiscard]] Result<RigidLinks> make_bore_links(const TetMesh& wall, const TriMesh& lumen);

/// Links points inside a lumen to three nodes of the wall around each of them, as evenly around it as there are: they go with the lumen's middle.
[[nodiscard]] Result<RigidLinks> make_middle_links(const TetMesh& wall, std::span<const Vec3> points);

/// Affine coordinates of p in the tetrahedron x. False, and weight untouched: it is too flat, or p too far from it, to carry a force.
[[nodiscard]] bool find_affine(const Vec3 (&x)[4], const Vec3& p, double (&weight)[4]) noexcept;

/// Tetrahedra around each node.
struct NodeTets {
    NodeTets(std::span<const Tet> tets, std::size_t node_count);
    [[nodiscard]] std::span<const Index> of(Index node) const noexcept { return {tet.data() + begin[node], begin[node + 1] - begin[node]}; }

    std::vector<Index> begin; // [node_count + 1]
    std::vector<Index> tet;   // ascending
};

/// A tetrahedron, and affine coordinates in it.
struct TetPlace {
    Index tet = kNoIndex; // kNoIndex: there is none
    double weight[4] = {};
    [[nodiscard]] double least() const noexcept { return std::min({weight[0], weight[1], weight[2], weight[3]}); }
};

/// Of the tetrahedra around these nodes, the one in which p lies deepest, or from which it lies least far, by its smallest coordinate; of equals the first.
[[nodiscard]] TetPlace find_tet_beneath(std::span<const Tet> tets, std::span<const Vec3> node_position, const NodeTets& around, std::span<const Index> nodes,
                                        const Vec3& p) noexcept;

/// These vertices follow the affine image of the tetrahedron beneath them from here on, instead of a triangle's frame: a sharp corner that is struck turns a
/// link of its length about its triangle, and gives way by more than what strikes it moved the nodes. Those too far off keep their link.
/// tets [tet_count], vertices [vertex_count] m as given to make_surface_links; which: each once
/// returns   how many do
std::size_t follow_tets(RigidLinks& links, std::span<const Tet> tets, std::span<const Vec3> vertices, std::span<const Index> which);

/// out[v] = position of dense vertex v, [vertex_count] m. node_position [node_count], rest [vertex_count] the dense mesh's
/// rest positions as given to make_*, out another array. frames is sized on the first call, without allocation later.
EmbeddedUpdateReport update_embedded_surface(const RigidLinks& links, std::span<const Vec3> node_position, std::span<const Vec3> rest, LinkFrames& frames,
                  std::span<Vec3> out) noexcept;

/// The two halves of it. A vertex position follows from the frames alone, so that it can be evaluated lazily.
EmbeddedUpdateReport turn_frames(const RigidLinks& links, std::span<const Vec3> node_position, LinkFrames& frames) noexcept;
void place_vertices(const RigidLinks& links, const LinkFrames& frames, std::span<const Vec3> rest, std::span<Vec3> out) noexcept;

/// Bytes that one update of the embedded surface reads and writes, every array once.
[[nodiscard]] std::size_t embedded_update_bytes(const RigidLinks& links) noexcept;

/// Coarse nodes that a dense vertex follows, at most.
inline constexpr std::size_t kMostLinkNodes = 4;

/// dp'/dq_i of one vertex, the turn of its frame included. Entries that are not used have zero blocks on nodes kNoIndex: all of a static vertex.
struct LinkJacobian {
    Index node[kMostLinkNodes] = {kNoIndex, kNoIndex, kNoIndex, kNoIndex};
    Mat3 block[kMostLinkNodes] = {Mat3::Zero(), Mat3::Zero(), Mat3::Zero(), Mat3::Zero()};
};
[[nodiscard]] LinkJacobian link_jacobian(const RigidLinks& links, Index vertex, std::span<const Vec3> node_position) noexcept;

/// The transpose: a force on the dense vertex as forces on its coarse nodes. Same sum (times the blend) and, for blend 1,
/// same moment about any point.
struct LinkForces {
    Index node[kMostLinkNodes] = {kNoIndex, kNoIndex, kNoIndex, kNoIndex};
    Vec3 force[kMostLinkNodes] = {Vec3::Zero(), Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};
};
[[nodiscard]] LinkForces spread_link_force(const RigidLinks& links, Index vertex, std::span<const Vec3> node_position,
                                           const Vec3& force) noexcept;

/// The same for what takes hold of tissue: the force on a vertex beside its tetrahedron acts on the nearest coordinates within it. Same sum, but not the
/// same moment: pulled at its tip, a soft corner would fold the tetrahedron beneath it over.
[[nodiscard]] LinkForces spread_hold(const RigidLinks& links, Index vertex, std::span<const Vec3> node_position, const Vec3& force) noexcept;

} // namespace trocar::fem
