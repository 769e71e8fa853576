// Groups of tetrahedra that share one deformation gradient, so that nearly incompressible tissue does not lock: a linear tetrahedron has
// too few freedoms to keep its volume and bend, eight of them together have enough. Of a patch with rest volumes V_e
//   Fm = sum V_e F_e / sum V_e        energy = sum V_e psi(Fm) + kPatchShare mu / 2 sum V_e |F_e - Fm|^2
// whatever the law psi: momentum, energy, rotation invariance and the patch test are those of any energy of nodal positions.
// This work is based on: de Souza Neto, Andrade Pires & Owen 2005, "F-bar-based linear triangles and tetrahedra" (patches); Flanagan &
// Belytschko 1981 (a weak elastic resistance to what the mean does not see). Deviates: the mean of F, not of its determinant alone, since
// linear tetrahedra are too stiff in bending at any Poisson ratio; an energy, so that nothing but the nodes' forces is averaged.
#pragma once

#include "base/mesh.hpp"

#include <span>
#include <vector>

namespace trocar::fem {

/// Of mu: resistance to what the patch's mean does not see. Less bends too much on coarse meshes, more bends too little: docs/tissue.md.
inline constexpr double kPatchShare = 0.15;

inline constexpr std::size_t kMostPatchTets = 8;

/// Patches of at most kMostPatchTets tets that hang together by faces and have the same stiffness factor; a row of so many places each,
/// kNoIndex where it is not full. They are as round as they can be, and the same however the mesh is turned but where tets are alike by symmetry.
/// position: [node_count]; stiffness: [tet_count]; order: all tets, in which such are taken. Depends on nothing else.
[[nodiscard]] std::vector<Index> make_patches(std::span<const Tet> tets, std::span<const Vec3> position, std::span<const double> stiffness,
                                               std::span<const Index> order);

} // namespace trocar::fem
