// Ties: springs of no length that hold nodes of one body to points in the tetrahedra of another (docs/tissue.md, "Walls joined to an organ").
// A tie pulls its two ends together along the line between them: both bodies' linear and angular momentum is kept, whatever its stiffness.
#pragma once

#include "fem/tissue/force_plan.hpp"

#include <array>
#include <span>
#include <vector>

namespace trocar::fem {

struct Tie {
    Index node = 0;                   // of the body that is tied
    std::array<Index, 4> host{};      // nodes of the other
    std::array<double, 4> weight{};   // [-] of these, sum 1
    double stiffness = 0.0;           // N/m, > 0
};

/// The two ends of ties, as the kernels keep them: [node_count] in each plan's order.
struct TieEnds {
    const ForcePlan& plan;
    const ForcePlan& host_plan;
};

/// [node_count] 1/s^2, by record: no eigenvalue of the ties' share of M^-1 K is larger than the largest of both bodies' numbers, and each body by
/// itself may take its own (a spring between a and b stores at most what two of twice its stiffness do that hold a and b to the ground).
[[nodiscard]] std::vector<double> bound_tied(std::span<const Tie> ties, const ForcePlan& plan);
[[nodiscard]] std::vector<double> bound_hosts(std::span<const Tie> ties, const ForcePlan& plan);

/// v += h a of the ties where the nodes stand.
void kick_by_ties(std::span<const Tie> ties, const TieEnds& ends, double h, std::span<NodeRecord> nodes, std::span<NodeRecord> host_nodes) noexcept;

/// N, added to what the nodes feel where they stand; nodes that are held feel nothing.
void add_tie_forces(std::span<const Tie> ties, const TieEnds& ends, std::span<const NodeRecord> nodes, std::span<const NodeRecord> host_nodes,
                      std::span<Vec3> force, std::span<Vec3> host_force) noexcept;

/// Adds what displacements of the nodes take from these forces. By record.
void add_tie_product(std::span<const Tie> ties, const TieEnds& ends, std::span<const Vec3> displacement, std::span<const Vec3> host_displacement,
                     std::span<Vec3> product, std::span<Vec3> host_product) noexcept;

} // namespace trocar::fem
