// Walls in layers of prisms, three tetrahedra each (mesh/mapped_mesh.hpp), that bend as shells do: of a pair of prisms P of rest volume V_P and height t,
//   F_P = grad at the prism's middle      Fm = sum V_P F_P / V      B_P = d F_P / d zeta . (1 - n n^T), zeta in [-1, 1] through the height, n across
//   energy = V psi(Fm) + E' / 6 sum V_P |B_P|^2 + w mu / 2 sum V_P |F_P - Fm|^2
// E' / 6 with E' = young_modulus / (1 - nu^2): bent to a curvature c a prism has B = t/2 c, and a plate E' t^3 / 24 c^2 for each area. w resists what neither
// the mean nor bending sees, the kink between the pair's two; it goes with (t / edge)^2, or it would outweigh bending. One prism by itself locks in shear
// where it is wider than thick, a pair of a regular mesh hardly, an irregular one less (docs/tissue.md). All is linear in the gradients F_k of the prism's tetrahedra: F_P = sum F_k M_k.
// This work is based on: Hauptmann & Schweizerhof 1998 (solid-shells), Bergou et al. 2006 (bending quadratic in positions; of a closed or clamped wall
// what it leaves out, the coefficient of Gauss's curvature, does no work), Flanagan & Belytschko 1981 (the weak resistance).
#pragma once

#include "fem/tissue/force_plan.hpp"

namespace trocar::fem {

/// plan.prisms, once its batches are there.
void fill_prisms(ForcePlan& plan, std::span<const Tet> tets, std::span<const TetShape> shapes, std::span<const Vec3> rest_position, Index sheet);

} // namespace trocar::fem
