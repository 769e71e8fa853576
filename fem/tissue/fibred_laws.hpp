// Energy density of the laws of rubber, organs and arteries, beside laws.hpp's. All are functions of C = F^T F, and J alone feels the sign:
//   ... + lambda / 2 ((J - a)^2 - (1 - a)^2), with the a that leaves no stress at rest: smooth through inversion, like neo_hookean's.
// This work is based on: Mooney 1940, Rivlin 1948; Ogden 1972; Holzapfel, Gasser & Ogden 2000 and Gasser, Ogden & Holzapfel 2006
// (dispersion). Deviates: C itself, not its isochoric part (Helfenstein et al. 2010: fibres should not stretch less because volume grows);
// the volume term above; polynomials beyond the range in which the law is meant to be used, so that forces stay finite.
#pragma once

#include "fem/tissue/block.hpp"
#include "fem/tissue/exponential.hpp"
#include "fem/tissue/logarithm.hpp"
#include "fem/tissue/material.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace trocar::fem {

[[nodiscard]] inline double volume_energy(const LawConstants& c, double det) noexcept {
    return 0.5 * c.lambda * (det - 1.0) * (det + 1.0 - 2.0 * c.rest_volume);
}

/// psi = c10 (I1 - 3) + c01 (I2 - 3) + volume
struct MooneyRivlinLaw {
    static double energy(const LawConstants& c, const Block<double>& f, double det, const FibreAxes*) noexcept {
        const Block<double> g = transposed_product(f, f);
        const double trace = g.m[0] + g.m[4] + g.m[8];
        return c.c10 * (trace - 3.0) + c.c01 * (0.5 * (trace * trace - contraction(g, g)) - 3.0) + volume_energy(c, det);
    }
};

/// Eigenvalues of a symmetric matrix, by cyclic Jacobi.
inline void find_eigenvalues(Block<double> a, double value[3]) noexcept {
    constexpr int kPairs[3][3] = {{0, 1, 2}, {0, 2, 1}, {1, 2, 0}};
    for (int sweep = 0; sweep < 6; ++sweep)
        for (const auto& [p, q, r] : kPairs) {
            const double off = a.m[3 * p + q], gap = a.m[4 * q] - a.m[4 * p], root = std::sqrt(gap * gap + 4.0 * off * off);
            const double below = gap < 0.0 ? gap - root : gap + root, t = below == 0.0 ? 0.0 : 2.0 * off / below;
            const double c = 1.0 / std::sqrt(t * t + 1.0), s = t * c, rp = a.m[3 * r + p], rq = a.m[3 * r + q];
            a.m[4 * p] -= t * off;
            a.m[4 * q] += t * off;
            a.m[3 * p + q] = a.m[3 * q + p] = 0.0;
            a.m[3 * r + p] = a.m[3 * p + r] = c * rp - s * rq;
            a.m[3 * r + q] = a.m[3 * q + r] = s * rp + c * rq;
        }
    for (int i = 0; i < 3; ++i) value[i] = a.m[4 * i];
}

/// psi = sum_p mu_p / alpha_p (l1^alpha_p + l2^alpha_p + l3^alpha_p - 3) + volume, l the principal stretches. Above a stretch of 10 the sum
/// goes on as a quadratic in l^2; below 0.3 as a line, or a negative alpha would let no crushed tet through its own plane, back to itself.
struct OgdenLaw {
    static double energy(const LawConstants& c, const Block<double>& f, double det, const FibreAxes*) noexcept {
        double square[3];
        find_eigenvalues(transposed_product(f, f), square);
        double sum = volume_energy(c, det);
        for (const double one : square) sum += curve(c, one);
        return sum;
    }
    static double curve(const LawConstants& c, double square) noexcept {
        const double inside = std::clamp(square, kLeastOgdenSquare, kMostOgdenSquare), beyond = square - inside, log = natural_log(inside);
        double sum = 0.0;
        for (int k = 0; k < c.ogden_terms; ++k) {
            const double half = 0.5 * c.ogden_alpha[k], slope = c.ogden_mu[k] * natural_exp((half - 1.0) * log); // twice that by l^2
            sum += c.ogden_mu[k] / c.ogden_alpha[k] * (natural_exp(half * log) - 1.0) +
                   0.5 * beyond * slope * (1.0 + (beyond < 0.0 ? 0.0 : 0.5 * beyond * (half - 1.0) / inside));
        }
        return sum;
    }
};

/// neo_hookean + sum over two families of k1 / (2 k2) (exp(k2 E^2) - 1), E = max(0, kappa (I1 - 3) + (1 - 3 kappa) (a . C a - 1)):
/// compressed fibres carry nothing. Beyond fibre_limit a quadratic goes on.
struct HgoLaw {
    static double energy(const LawConstants& c, const Block<double>& f, double det, const FibreAxes* fibres) noexcept {
        const double size_sq = contraction(f, f);
        double sum = 0.5 * c.mu * ((size_sq - 3.0) - natural_log(0.25 * (size_sq + 1.0))) + volume_energy(c, det);
        for (int family = 0; family < 2; ++family) sum += fibre(c, find_strain(c, f, size_sq, fibres->axis + 3 * family));
        return sum;
    }
    static double find_strain(const LawConstants& c, const Block<double>& f, double size_sq, const double* a) noexcept {
        double stretch_sq = 0.0;
        for (int i = 0; i < 9; i += 3) {
            const double along = f.m[i] * a[0] + f.m[i + 1] * a[1] + f.m[i + 2] * a[2];
            stretch_sq += along * along;
        }
        return c.kappa * (size_sq - 3.0) + (1.0 - 3.0 * c.kappa) * (stretch_sq - 1.0);
    }
    static double fibre(const LawConstants& c, double strain) noexcept {
        const double inside = std::clamp(strain, 0.0, c.fibre_limit), beyond = std::max(0.0, strain - c.fibre_limit);
        const double square = inside * inside, exponent = c.k2 * square, steep = natural_exp(exponent);
        // (e^x - 1) / k2; of a small x by its series, where the difference would lose it
        const double stored = exponent > kSmallExponent ? (steep - 1.0) / c.k2
                                                        : square * (1.0 + exponent * (1.0 / 2.0 + exponent * (1.0 / 6.0 + exponent / 24.0)));
        return 0.5 * c.k1 * stored + c.k1 * steep * beyond * (inside + 0.5 * beyond * (1.0 + 2.0 * c.k2 * inside * inside));
    }
};

} // namespace trocar::fem
