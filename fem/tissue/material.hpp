// Materials of the tissue: three hyperelastic laws plus Kelvin-Voigt viscosity, all from E and nu in SI units.
// This work is based on: O'Brien & Hodgins 1999 (StVK, viscosity); Mueller & Gross 2004 (corotational);
// Smith, de Goes & Kim 2018, "Stable Neo-Hookean Flesh Simulation" (neo_hookean).
#pragma once

#include "base/result.hpp"

#include <cstdint>

namespace trocar::fem {

/// stvk softens under compression and has no resistance left below a stretch of 0.577; corotational is linear in stretch;
/// neo_hookean is finite and restoring through inversion: the one to use unless there is a reason.
enum class MaterialLaw : std::uint8_t { StVK, Corotational, NeoHookean };

struct Material {
    MaterialLaw law = MaterialLaw::NeoHookean;
    double young_modulus = 5000.0; // Pa, > 0
    double poisson_ratio = 0.45;   // [-], in [0, 0.5). Above 0.45 linear tets lock: far too stiff in bending
    double density = 1060.0;       // kg/m^3, > 0
    double viscosity = 0.0;        // Pa s, on the rate of Green strain: S = 2 viscosity dE/dt. Shrinks the stable step
    double mass_damping = 0.0;     // 1/s, drags every node towards rest in the world frame: it also damps free flight
};

/// Coefficients a law computes with.
struct LawConstants {
    double mu = 0.0;          // Pa. Lame's shear modulus; neo_hookean: 4/3 of it (the reparametrisation of Smith et al.)
    double lambda = 0.0;      // Pa. Lame's first parameter; neo_hookean: lambda + 5/6 mu
    double rest_volume = 1.0; // [-]. neo_hookean: the alpha of (J - alpha)^2 that makes the rest state free of stress
};

/// Which rule carries the tissue over a sub-step.
enum class Integrator : std::uint8_t { Rk4, Leapfrog };

/// Finite and in range, or BadValue naming the field and the value found.
[[nodiscard]] Result<void> check_material(const Material& material);

/// The material must have passed check_material.
[[nodiscard]] LawConstants make_law_constants(const Material& material) noexcept;

/// Above this ratio linear tetrahedra lock volumetrically. Cantilever tip against Timoshenko, 41K tets: 0.88 at 0.45,
/// 0.71 at 0.49, 0.29 at 0.499.
inline constexpr double kLockingPoissonRatio = 0.45;

} // namespace trocar::fem
