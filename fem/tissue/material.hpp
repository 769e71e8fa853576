// Materials of the tissue: hyperelastic laws plus Kelvin-Voigt viscosity, in SI units.
// This work is based on: O'Brien & Hodgins 1999 (StVK, viscosity); Mueller & Gross 2004 (corotational);
// Smith, de Goes & Kim 2018, "Stable Neo-Hookean Flesh Simulation" (neo_hookean); fibred_laws.hpp names those of the other three.
#pragma once

#include "base/result.hpp"
#include "base/vec.hpp"

#include <array>
#include <cstdint>

namespace trocar::fem {

/// stvk softens under compression and has no resistance left below a stretch of 0.577; corotational is linear in stretch;
/// neo_hookean is finite and restoring through inversion: the one to use unless there is a reason.
enum class MaterialLaw : std::uint8_t { StVK, Corotational, NeoHookean, MooneyRivlin, Ogden, Hgo };

/// Linear tets, each for itself or in patches that share a deformation gradient (patches.hpp); automatic: patches above
/// kPatchedPoissonRatio, but for StVK. Prisms: of walls in layers (prisms.hpp).
enum class TetElements : std::uint8_t { Automatic, Linear, Patched, Prisms };

struct Material {
    MaterialLaw law = MaterialLaw::NeoHookean;
    double young_modulus = 5000.0; // Pa, > 0; of mooney_rivlin and ogden a result: find_young_modulus. hgo: of the ground without fibres
    double poisson_ratio = 0.45;   // [-], in [0, 0.5). From 0.4 on linear tets lock, far too stiff in bending: elements
    double density = 1060.0;       // kg/m^3, > 0
    double viscosity = 0.0;        // Pa s, on the rate of Green strain: S = 2 viscosity dE/dt. Shrinks the stable step
    double mass_damping = 0.0;     // 1/s, drags every node towards rest in the world frame: it also damps free flight
    TetElements elements = TetElements::Automatic;
    // mooney_rivlin
    double c10 = 0.0, c01 = 0.0; // Pa, shear modulus 2 (c10 + c01)
    // ogden; terms whose alpha is 0 are not there. Shear modulus: half the sum of mu alpha
    double mu1 = 0.0, mu2 = 0.0, mu3 = 0.0; // Pa
    double alpha1 = 0.0, alpha2 = 0.0, alpha3 = 0.0;
    // hgo
    double k1 = 0.0;             // Pa, of either family of fibres
    double k2 = 1.0;             // [-], > 0
    double kappa = 0.0;          // [-] dispersion, 0: all along the direction, 1/3: along all directions alike
    Vec3 fibre1 = Vec3::UnitX(); // at rest, of any length; without fibre_axis
    Vec3 fibre2 = Vec3::UnitX();
    Vec3 fibre_axis = Vec3::Zero();  // not zero: fibres wind round the line through fibre_point along it, both ways
    Vec3 fibre_point = Vec3::Zero(); // m
    double fibre_angle = 0.0;        // rad, from the circumference towards the axis
    // branches beside any law, that relax: relaxation.hpp. Those whose g is 0 are not there
    double g1 = 0.0, g2 = 0.0, g3 = 0.0;       // [-] of the shear modulus
    double tau1 = 0.0, tau2 = 0.0, tau3 = 0.0; // s
};

/// Of small strains about rest, without fibres: Pa.
struct SmallStrain {
    double mu = 0.0, lambda = 0.0;
    [[nodiscard]] double young_modulus() const noexcept { return mu * (3.0 * lambda + 2.0 * mu) / (lambda + mu); }
    [[nodiscard]] double bulk_modulus() const noexcept { return lambda + 2.0 / 3.0 * mu; }
};
[[nodiscard]] SmallStrain find_small_strain(const Material& material) noexcept;

/// Both directions at a place of the rest shape, of length 1.
struct FibreAxes {
    double axis[6];
};
[[nodiscard]] FibreAxes find_fibres(const Material& material, const Vec3& place) noexcept;

[[nodiscard]] bool uses_patches(const Material& material) noexcept;

/// Coefficients a law computes with.
struct LawConstants {
    double mu = 0.0;          // Pa. Lame's shear modulus; neo_hookean, hgo: 4/3 of it (the reparametrisation of Smith et al.)
    double lambda = 0.0;      // Pa. Lame's first parameter; neo_hookean, hgo: lambda + 5/6 mu; of the others make_law_constants says
    double rest_volume = 1.0; // [-]. of all but stvk and corotational: the alpha of (J - alpha)^2 that makes the rest state free of stress
    double c10 = 0.0, c01 = 0.0;
    std::array<double, 3> ogden_mu = {}, ogden_alpha = {}; // the first ogden_terms
    int ogden_terms = 0;
    double k1 = 0.0, k2 = 1.0, kappa = 0.0, fibre_limit = 1.0; // fibre_limit: [-] strain, where the exponential ends
    double patch = 0.0;                                        // Pa. Of patched tets: resistance to what their mean does not see
    double bend = 0.0;                                         // Pa. Of prisms: a third of young_modulus / (1 - nu^2)
};

inline constexpr double kLeastOgdenSquare = 0.09, kMostOgdenSquare = 100.0; // [-] squared stretches: OgdenLaw
inline constexpr double kMostFibreExponent = 6.0;                           // [-] k2 E^2 of a fibre: HgoLaw
inline constexpr double kSmallExponent = 1e-3;                              // [-] k2 E^2 below which e^x - 1 is its series, to 1e-14

/// Which explicit rule carries the tissue over a sub-step. (Implicit steps: implicit.hpp.)
enum class Integrator : std::uint8_t { Rk4, Leapfrog };

/// Finite and in range, or BadValue naming the field and the value found.
[[nodiscard]] Result<void> check_material(const Material& material);

/// The material must have passed check_material.
[[nodiscard]] LawConstants make_law_constants(const Material& material) noexcept;

/// Above this ratio linear tetrahedra lock volumetrically. Cantilever tip against Timoshenko, 41K tets: 0.88 at 0.45,
/// 0.71 at 0.49, 0.29 at 0.499.
inline constexpr double kLockingPoissonRatio = 0.45;
/// From this ratio on tets are patched unless the material says otherwise.
inline constexpr double kPatchedPoissonRatio = 0.4;

} // namespace trocar::fem
