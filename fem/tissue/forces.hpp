// Elastic and viscous forces of linear tetrahedra: f_a = -V0 P(F) grad_a, F = sum_a x_a (x) grad_a.
// This work is based on: O'Brien & Hodgins 1999, section 3.2. Deviates: first Piola-Kirchhoff form, Green strain with the
// factor 1/2, so that Young's modulus and Poisson's ratio are the engineer's.
#pragma once

#include "fem/tissue/kernels.hpp"
#include "fem/tissue/tissue.hpp"

namespace trocar::fem {

struct TetReport {
    double min_volume_ratio = 1.0; // det F of the most compressed tet, [-]; <= 0: inverted
    Index min_volume_tet = kNoIndex;
    std::uint32_t inverted = 0;     // tets with det F <= 0
    double elastic_energy = 0.0;    // J, 0 at rest for every law; filled by measure_tets only
    Index first_bad_tet = kNoIndex; // first tet with a det F or energy that is not finite; filled by measure_tets only
};

/// Adds the nodal forces of every tetrahedron, elastic and (viscosity > 0) viscous.
/// position, velocity [node_count] m, m/s     force [node_count] N, added to, never cleared
/// Finite positions within any stretch a double can square give finite forces: no law divides by det F.
/// The integrators run the same kernels on records of their own; this one gathers, scatters and allocates.
TetReport add_tet_forces(const TissueModel& model, std::span<const Vec3> position, std::span<const Vec3> velocity, std::span<Vec3> force);

/// Energy, volume ratios and first bad element of a configuration; no forces.
[[nodiscard]] TetReport measure_tets(const TissueModel& model, std::span<const Vec3> position) noexcept;
/// The same of records in the plan's order, vectorised; scratch [plan.chunks.size()].
[[nodiscard]] TetReport measure_tets(const TissueModel& model, std::span<const NodeRecord> records, std::span<TetSum> scratch,
                                     unsigned threads) noexcept;

/// Adds K(x) d, the elastic stiffness at `position` times a nodal displacement (exact derivative of -add_tet_forces).
/// Returns the tet that takes up the most energy of d: max d_e . K_e d_e.
Index add_stiffness_product(const TissueModel& model, std::span<const Vec3> position, std::span<const Vec3> displacement,
                            std::span<Vec3> product);

/// Adds C(x) v, the viscous drag at `position` (exactly linear in v). Nothing to add where viscosity is 0.
void add_damping_product(const TissueModel& model, std::span<const Vec3> position, std::span<const Vec3> velocity, std::span<Vec3> product);

/// What the kernels need of a body's material.
[[nodiscard]] TetJob make_tet_job(const TissueModel& model, TetKernel kernel, unsigned threads) noexcept;

/// Caller's order to records: x = position, v = second (empty: left as they are), and back.
void gather_records(const ForcePlan& plan, std::span<const Vec3> position, std::span<const Vec3> second,
                    std::span<NodeRecord> records) noexcept;
void scatter_records(const ForcePlan& plan, std::span<const NodeRecord> records, std::span<Vec3> position, std::span<Vec3> second) noexcept;

} // namespace trocar::fem
