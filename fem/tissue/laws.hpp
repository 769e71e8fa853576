// Energy density of one deformation gradient, for every law. The kernels' forces (tet_laws-inl.hpp) are their negative gradients.
#pragma once

#include "fem/tissue/block.hpp"
#include "fem/tissue/logarithm.hpp"
#include "fem/tissue/material.hpp"
#include "fem/tissue/polar.hpp"

namespace trocar::fem {

/// St. Venant-Kirchhoff, psi = lambda/2 tr(E)^2 + mu E:E with E = (F^T F - I)/2.
struct StVKLaw {
    static double energy(const LawConstants& c, const Block<double>& f, double, const FibreAxes* = nullptr) noexcept {
        Block<double> e = transposed_product(f, f);
        for (int i = 0; i < 9; ++i) e.m[i] *= 0.5;
        for (int i = 0; i < 9; i += 4) e.m[i] -= 0.5;
        const double trace = e.m[0] + e.m[4] + e.m[8];
        return 0.5 * c.lambda * trace * trace + c.mu * contraction(e, e);
    }
};

/// Corotational, psi = mu |F - R|^2 + lambda/2 tr(R^T F - I)^2: linear elasticity in the frame that turns with the tet.
struct CorotationalLaw {
    static double energy(const LawConstants& c, const Block<double>& f, double, const FibreAxes* = nullptr) noexcept {
        const Block<double> r = nearest_rotation(f);
        double distance_sq = 0.0;
        for (int i = 0; i < 9; ++i) distance_sq += (f.m[i] - r.m[i]) * (f.m[i] - r.m[i]);
        const double trace = contraction(r, f) - 3.0;
        return c.mu * distance_sq + 0.5 * c.lambda * trace * trace;
    }
};

/// Stable neo-Hookean, psi = mu/2 (I - 3) + lambda/2 (J - alpha)^2 - mu/2 log(I + 1), I = |F|^2: smooth through inversion.
struct NeoHookeanLaw {
    /// Shifted to 0 at rest; the differences are taken before the logarithm, so that small strains keep their digits.
    static double energy(const LawConstants& c, const Block<double>& f, double det, const FibreAxes* = nullptr) noexcept {
        const double size_sq = contraction(f, f);
        return 0.5 * c.mu * ((size_sq - 3.0) - natural_log(0.25 * (size_sq + 1.0))) +
               0.5 * c.lambda * (det - 1.0) * (det + 1.0 - 2.0 * c.rest_volume);
    }
};

} // namespace trocar::fem
