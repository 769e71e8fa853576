// Walls in layers of prisms, three tetrahedra each (mesh/mapped_mesh.hpp), that bend as shells do: of a pair of prisms P of rest volume V_P and height t,
//   F_P = grad at the prism's middle      Fm = sum V_P F_P / V      B_P = d F_P / d zeta . (1 - n n^T), zeta in [-1, 1] through the height, n across
//   N = cof(Fm) n / |cof(Fm) n|      d = Fm n      J_P = (F_P - Fm) (1 - n n^T)      Fs = Fm - (1 - s) (d - N (N.d)) n^T + R
//   energy = V psi(Fs) + E' / 6 sum V_P |B_P|^2 + mu / 2 sum V_P (kHoldShare |J_P|^2 - (kHoldShare - w) |N^T J_P|^2)
// E' / 6 with E' = young_modulus / (1 - nu^2): bent to a curvature c a prism has B = t/2 c, and a plate E' t^3 / 24 c^2 for each area.
// The law sees s of the shear across the wall: what a bent wall's middle faces have of it, of which a thin wall has none, is of their size, and would lock where
// they are wider than the wall is thick: with t the whole wall's thickness and h^2 the area of two such faces,
//   s^2 = t^2 / (t^2 + 0.1 h^2)
// R is what the mean of two faces that are folded against one another has too little of: along the wall the metric Fs^T Fs is that of Fm and sum V_P (J_P^T N) (J_P^T N)^T / V,
// as the faces' own is; without it a wall under tension would fold, which its tension resists. The last term resists what neither the mean nor bending sees: what the two faces
// are stretched by apart, and the kink between them, as weakly as they bend: w = 0.03 t^2 / h^2. All gradients are linear in the edges of the prisms' outer tetrahedra,
// one on each face, which have all of its corners; the one between them feels nothing.
// This work is based on: Hauptmann & Schweizerhof 1998 (solid-shells), Bergou et al. 2006 (bending quadratic in positions; of a closed or clamped wall
// what it leaves out, the coefficient of Gauss's curvature, does no work), Lyly, Stenberg & Vihinen 1993 (shear that goes with t^2 / h^2), Flanagan & Belytschko 1981
// (the weak resistance). Deviates: the shear is that of the pair's mean, of large deformation, and any law's.
#pragma once

#include "fem/tissue/force_plan.hpp"
#include "fem/tissue/patches.hpp"

namespace trocar::fem {

inline constexpr std::size_t kPrismTets = 3, kPairTets = 2 * kPrismTets;

/// Of a pair's tetrahedra: on a face of its prism.
constexpr bool is_outer(std::size_t k) noexcept { return k % kPrismTets != 1; }

/// Of mu: resistance to what the two prisms of a pair are stretched by apart.
inline constexpr double kHoldShare = 1.0;

/// [-] of the area of a pair at rest: of one crushed to less along the wall, N is shorter than 1 instead of unknown.
inline constexpr double kLeastPairArea = 0.05;

/// plan.prisms and pairs, once its batches are there.
void fill_prisms(ForcePlan& plan, std::span<const Tet> tets, std::span<const TetShape> shapes, std::span<const Vec3> rest_position, Index sheet);

} // namespace trocar::fem
