// The classical cases of vessels' walls (mesh/wall_mesh.hpp) against closed forms, as those of classical_cases.hpp.
#pragma once

#include "fem/tissue/material.hpp"

namespace trocar::fem {

/// Widening of the thin wall around a sphere, a tenth of its radius thick, under an inner pressure over Lame's: of the mesh that walls of vessels have.
/// around  triangles' edges on a great circle
[[nodiscard]] double shell_ratio(Index around, Index layers, double poisson_ratio, TetElements elements);
/// Shortening of a ring, a tenth of its radius thick, between two opposite loads over that of a thin one, (pi / 4 - 2 / pi) P R^3 / E I: how a vessel's
/// wall of so many layers bends.
/// around  triangles' edges on the bore
[[nodiscard]] double crushed_ring_ratio(Index around, Index layers, double poisson_ratio, TetElements elements);
/// Way of the wall where a tube is pressed from inside, over a width of about 0.3 of its bore's radius; 0.2 of that thick, 6 long, held at both ends. Of modulus, radius and force 1.
[[nodiscard]] double pressed_tube_way(Index around, Index layers, double poisson_ratio, TetElements elements);
/// Way of the middle of a square plate, clamped all around, under a pressure over the thin plate's 0.001265 p a^4 / D (Timoshenko & Woinowsky-Krieger 1959), nu 0.3.
/// thickness: of its side; its corners stand at random up to `uneven` of a cell beside their places, and the diagonals of its cells go either way.
[[nodiscard]] double pressed_plate_ratio(Index cells, double thickness, double uneven, TetElements elements);
/// Of that plate's way, of prisms: power of viscosity over that of elasticity, with a viscosity of as many Pa s as mu has Pa.
[[nodiscard]] double pressed_plate_damping(Index cells, double thickness, double uneven);
/// Of that plate's way, of prisms: work against a branch of g 1 that has not relaxed over that against elasticity.
[[nodiscard]] double pressed_plate_relaxation(Index cells, double thickness, double uneven);

} // namespace trocar::fem
