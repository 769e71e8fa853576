// The model against answers that are known: one function for each, which the tests and the validation table share. Each makes its own
// body and returns what it measured; none is part of a step.
#pragma once

#include "fem/tissue/material.hpp"
#include "fem/tissue/tissue.hpp"

namespace trocar::fem {

/// Largest force on a node inside a uniformly strained patch of 4 x 4 x 4 rough cells, over the largest on its surface; 0 is right.
[[nodiscard]] double patch_error(MaterialLaw law);

/// First axial frequency of a free slender bar over sqrt(E / rho) / (2 L). cells along its length
[[nodiscard]] double axial_mode_ratio(MaterialLaw law, Index cells);

enum class Wave : std::uint8_t { Pressure, Shear };
/// Speed of a plane wave in a block over the continuum's.
[[nodiscard]] double wave_speed_ratio(Wave wave, double poisson_ratio);

/// Tip of a bar of 0.4 x 0.1 x 0.1 m, clamped at one end, loaded by 1 mN at the other, over Timoshenko's with Cowper's coefficient. turn: a
/// rotation of the whole, mesh, clamp and load
[[nodiscard]] double cantilever_ratio(Index cells_across, double poisson_ratio, TetElements elements = TetElements::Linear,
                                      const Mat3& turn = Mat3::Identity());

/// Pressure of a cube squeezed by 1e-6 over 3 K 1e-6.
[[nodiscard]] double bulk_ratio(MaterialLaw law);

struct FreeFlight {
    double linear = 0.0, angular = 0.0; // [-] change of the momentum over its size
};
/// A viscous bar that tumbles and wobbles for 0.1 s in RK4 steps of `share` of the stable one.
[[nodiscard]] FreeFlight free_flight_error(MaterialLaw law, double share);

struct StepError {
    double step, error;
}; // s, m
/// Farthest node from a much finer run after 0.05 s of a swinging bar, for steps that are halved `levels` times.
[[nodiscard]] std::vector<StepError> step_errors(Integrator integrator, int levels);

/// Total energy of a free tumbling bar over its first, once every 0.1 s for `seconds`, in steps of `share` of the stable one.
[[nodiscard]] std::vector<double> energy_over_time(Integrator integrator, double share, double seconds);

/// Energy after `steps` steps from a small random push over the first, at `share` of the integrator's exact limit; infinite
/// where the state is no longer finite.
[[nodiscard]] double growth_at_edge(MaterialLaw law, Integrator integrator, double share, unsigned steps);

} // namespace trocar::fem
