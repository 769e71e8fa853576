// How well and how fast wrapped trees follow a body that bends.
#pragma once

#include "bench/solid_bodies.hpp"
#include "bench/tables.hpp"

namespace trocar::engine {

/// A row for each deformation and way of updating: what of the surface the spheres lose, how far it reaches out of them, what
/// they grow by, ns per sphere; and the descent's rate of tests when spheres are evaluated lazily.
/// fails   where the body has no lattice of tetrahedra
[[nodiscard]] Result<void> add_updates(const SolidBody& body, BenchTable& table);

} // namespace trocar::engine
