// The classical cases of solids against closed forms and tabulated answers: one function for each, which the tests and the tables share. Each
// makes its own body and returns what it measured; none is part of a step.
#pragma once

#include "fem/tissue/material.hpp"

namespace trocar::fem {

/// Cook's membrane, nu 1/3, E = F = 1, a plate 1 thick with free faces: vertical way of the middle of its end. cells along either edge
[[nodiscard]] double cook_tip(Index cells, TetElements elements);
inline constexpr double kCookTip = 23.96; // plane stress, quoted

/// How deep a load on the middle quarter of the top of a cube presses it, held below.
[[nodiscard]] double block_sink(Index cells, double poisson_ratio, TetElements elements);

/// Widening of the bore of a hollow sphere, radii 1 and 2, under an inner pressure over Lame's. cells through the wall
[[nodiscard]] double hollow_sphere_ratio(Index cells, double poisson_ratio, TetElements elements);
/// The same of a ring with free faces: of a vessel's wall, radii 1 and 1.4, plane stress.
[[nodiscard]] double ring_ratio(Index cells, double poisson_ratio, TetElements elements);

/// A tube of these radii of an artery's media (Holzapfel, Gasser & Ogden 2000), whose fibres wind round it, under a dead load on its bore that widens it by
/// `widening` of its radius in the closed form of large strains, and on its ends what the closed form has there, which comes to no force in all: the bore's
/// widening over that, where it has come to rest.
[[nodiscard]] double artery_ratio(Index cells, double widening, TetElements elements);

/// Torque over the twist rate in the middle of a square bar, twisted a little at its ends, over Saint-Venant's 0.1406 G a^4.
[[nodiscard]] double torsion_ratio(Index cells_across, double poisson_ratio, TetElements elements);

/// First frequency of a cantilever, ten times as long as it is thick, over Timoshenko's.
[[nodiscard]] double bending_mode_ratio(Index cells_across, double poisson_ratio, TetElements elements);

struct TurnedBar {
    double left = 0.0;       // [-] of its side: farthest node from rest in the end
    unsigned inverted = 0;   // tetrahedra at the worst
    double peak_j = 0.0;     // elastic energy at the full turn
    double energy_left = 0.0; // [-] of that in the end
};
/// A column of 1 x 1 x 6 (as in Bonet, Gil & Ortigosa 2015) whose ends are turned by 360 degrees against one another and back, slowly.
[[nodiscard]] TurnedBar turn_bar(MaterialLaw law, Index cells_across);

} // namespace trocar::fem
