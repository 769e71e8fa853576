// Stress that relaxes: Maxwell branches beside any law (a Prony series). Each branch has a strain of its own, Ev, that follows Green's
// strain in the time tau; what is left between them pulls back:
//   S = ... + sum_i 2 mu g_i (dev E - Ev_i)        dEv_i/dt = (dev E - Ev_i) / tau_i
// with mu the law's shear modulus at rest, so that at small strain G(t) = mu (1 + sum_i g_i exp(-t / tau_i)). Of patched tets E is that of
// the patch's mean, of walls in prisms of what their law feels (prisms.hpp);
// they have the same of each prism's bending C = sym(Fm^T B) along the wall, with the modulus that a plate's bending takes from 2 mu g dev E.
// This work is based on: Simo 1987 (linear evolution of internal variables at finite strain); Taylor, Pister & Goudreau 1970 (the update,
// which is exact for a strain that stands still over the sub-step). Deviates: a strain as internal variable, so that the energy
// mu g |dev E - Ev|^2 and what it loses are known, and nothing divides by det F.
#pragma once

#include "fem/tissue/tissue.hpp"

namespace trocar::fem {

/// Branches that the material has.
[[nodiscard]] int count_branches(const Material& material) noexcept;

/// Numbers that a state keeps: six for each branch and tet, or patch, twelve for a pair of prisms; 0: the material has no branch.
[[nodiscard]] std::size_t relaxation_size(const TissueModel& model) noexcept;

/// Adds the branches' forces to the partial sums of the plan. records [node_count], relaxed [relaxation_size]
void add_relaxation_forces(const TissueModel& model, std::span<const NodeRecord> records, std::span<const double> relaxed,
                           std::span<PartialForce> partial, unsigned threads) noexcept;

/// Over h seconds with the nodes where they are.
void relax(const TissueModel& model, std::span<const NodeRecord> records, double h, std::span<double> relaxed, unsigned threads) noexcept;

/// [-] by how much branches stiffen the shear: 1 + sum_i g_i.
[[nodiscard]] double instant_share(const Material& material) noexcept;

} // namespace trocar::fem
