// Stress, its derivative and energy density of one deformation gradient, for every law. T is double or a pair of doubles.
#pragma once

#include "fem/lanes.hpp"
#include "fem/logarithm.hpp"
#include "fem/material.hpp"
#include "fem/polar.hpp"

namespace seldinger::fem {

template <class T> [[nodiscard]] inline Block<T> find_rotation(const Block<T>& f) noexcept {
    Block<double> of_lane[LaneTraits<T>::kCount];
    for (int lane = 0; lane < LaneTraits<T>::kCount; ++lane) {
        for (int i = 0; i < 9; ++i) of_lane[lane].m[i] = get_lane(f.m[i], lane);
        of_lane[lane] = nearest_rotation(of_lane[lane]);
    }
    Block<T> rotation;
    for (int i = 0; i < 9; ++i) rotation.m[i] = make_lanes<T>([&](int lane) { return of_lane[lane].m[i]; });
    return rotation;
}

/// St. Venant-Kirchhoff, psi = lambda/2 tr(E)^2 + mu E:E with E = (F^T F - I)/2.
struct StVKLaw {
    template <class T> static Block<T> second_stress(const LawConstants& c, const Block<T>& strain) noexcept {
        const T trace = c.lambda * (strain.m[0] + strain.m[4] + strain.m[8]);
        Block<T> s;
        for (int i = 0; i < 9; ++i) s.m[i] = 2.0 * c.mu * strain.m[i];
        for (int i = 0; i < 9; i += 4) s.m[i] += trace;
        return s;
    }
    template <class T> static Block<T> strain_of(const Block<T>& f) noexcept {
        Block<T> e = transposed_product(f, f);
        for (int i = 0; i < 9; ++i) e.m[i] *= 0.5;
        for (int i = 0; i < 9; i += 4) e.m[i] -= 0.5;
        return e;
    }
    template <class T>
    static Block<T> stress(const LawConstants& c, const Block<T>& f, const Block<T>&, const T&) noexcept {
        return product(f, second_stress(c, strain_of(f)));
    }
    template <class T>
    static Block<T> stress_along(const LawConstants& c, const Block<T>& f, const Block<T>&, const T&,
                                 const Block<T>& d) noexcept {
        const Block<T> cross = transposed_product(f, d);
        Block<T> rate;
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) rate.m[3 * i + j] = 0.5 * (cross.m[3 * i + j] + cross.m[3 * j + i]);
        const Block<T> a = product(d, second_stress(c, strain_of(f)));
        Block<T> b = product(f, second_stress(c, rate));
        for (int i = 0; i < 9; ++i) b.m[i] += a.m[i];
        return b;
    }
    /// Scale of the tangent's largest eigenvalue, Pa: compared with itself only, to see a tet stiffen.
    template <class T> static T tangent_scale(const LawConstants& c, const Block<T>& f, const Block<T>&, const T&) noexcept {
        return (c.lambda + 2.0 * c.mu) * contraction(f, f);
    }
    static double energy(const LawConstants& c, const Block<double>& f, double) noexcept {
        const Block<double> e = strain_of(f);
        const double trace = e.m[0] + e.m[4] + e.m[8];
        return 0.5 * c.lambda * trace * trace + c.mu * contraction(e, e);
    }
};

/// Corotational, psi = mu |F - R|^2 + lambda/2 tr(R^T F - I)^2: linear elasticity in the frame that turns with the tet.
struct CorotationalLaw {
    template <class T>
    static Block<T> stress(const LawConstants& c, const Block<T>& f, const Block<T>&, const T&) noexcept {
        const Block<T> r = find_rotation(f);
        const T pressure = c.lambda * (contraction(r, f) - 3.0) - 2.0 * c.mu;
        Block<T> p;
        for (int i = 0; i < 9; ++i) p.m[i] = 2.0 * c.mu * f.m[i] + pressure * r.m[i];
        return p;
    }
    template <class T>
    static Block<T> stress_along(const LawConstants& c, const Block<T>& f, const Block<T>&, const T&,
                                 const Block<T>& d) noexcept {
        const Block<T> r = find_rotation(f);
        const T pressure = c.lambda * (contraction(r, f) - 3.0) - 2.0 * c.mu;
        const T growth = c.lambda * contraction(r, d);
        const Block<T> turn = rotation_along(f, r, d);
        Block<T> p;
        for (int i = 0; i < 9; ++i) p.m[i] = 2.0 * c.mu * d.m[i] + growth * r.m[i] + pressure * turn.m[i];
        return p;
    }
    /// Linear in stretch: it never stiffens.
    template <class T> static T tangent_scale(const LawConstants& c, const Block<T>& f, const Block<T>&, const T&) noexcept {
        return (c.lambda + 2.0 * c.mu) + 0.0 * f.m[0];
    }
    static double energy(const LawConstants& c, const Block<double>& f, double) noexcept {
        const Block<double> r = nearest_rotation(f);
        double distance_sq = 0.0;
        for (int i = 0; i < 9; ++i) distance_sq += (f.m[i] - r.m[i]) * (f.m[i] - r.m[i]);
        const double trace = contraction(r, f) - 3.0;
        return c.mu * distance_sq + 0.5 * c.lambda * trace * trace;
    }
    /// dR = R [w]x with (tr(S) I - S) w = axial(R^T d - d^T R), S = R^T F.
    template <class T>
    static Block<T> rotation_along(const Block<T>& f, const Block<T>& r, const Block<T>& d) noexcept {
        Block<T> g = transposed_product(r, f);
        const Block<T> a = transposed_product(r, d);
        const T trace = g.m[0] + g.m[4] + g.m[8];
        for (int i = 0; i < 9; ++i) g.m[i] = -g.m[i];
        for (int i = 0; i < 9; i += 4) g.m[i] += trace;
        const Block<T> cof = cofactors(g);
        const T volume = g.m[0] * cof.m[0] + g.m[1] * cof.m[1] + g.m[2] * cof.m[2];
        // an exactly mirrored tet turns infinitely fast: cap it
        const T det = make_lanes<T>([&](int lane) { return get_lane(volume, lane) > 1e-6 ? get_lane(volume, lane) : 1e-6; });
        const T axial[3] = {a.m[7] - a.m[5], a.m[2] - a.m[6], a.m[3] - a.m[1]};
        T w[3];
        for (int i = 0; i < 3; ++i)
            w[i] = (cof.m[i] * axial[0] + cof.m[3 + i] * axial[1] + cof.m[6 + i] * axial[2]) / det;
        const Block<T> skew{{T{}, -w[2], w[1], w[2], T{}, -w[0], -w[1], w[0], T{}}};
        return product(r, skew);
    }
};

/// Stable neo-Hookean, psi = mu/2 (I - 3) + lambda/2 (J - alpha)^2 - mu/2 log(I + 1), I = |F|^2: smooth through inversion.
struct NeoHookeanLaw {
    template <class T>
    static Block<T> stress(const LawConstants& c, const Block<T>& f, const Block<T>& cof, const T& det) noexcept {
        const T size_sq = contraction(f, f);
        const T shear = c.mu * (size_sq / (size_sq + 1.0));
        const T pressure = c.lambda * (det - c.rest_volume);
        Block<T> p;
        for (int i = 0; i < 9; ++i) p.m[i] = shear * f.m[i] + pressure * cof.m[i];
        return p;
    }
    template <class T>
    static Block<T> stress_along(const LawConstants& c, const Block<T>& f, const Block<T>& cof, const T& det,
                                 const Block<T>& d) noexcept {
        const T grown = contraction(f, f) + 1.0;
        const T shear = c.mu * ((grown - 1.0) / grown);
        const T along = 2.0 * c.mu * contraction(f, d) / (grown * grown);
        const T pressure = c.lambda * (det - c.rest_volume);
        const T growth = c.lambda * contraction(cof, d);
        const Block<T> turn = cofactors_along(f, d);
        Block<T> p;
        for (int i = 0; i < 9; ++i)
            p.m[i] = shear * d.m[i] + along * f.m[i] + growth * cof.m[i] + pressure * turn.m[i];
        return p;
    }
    template <class T>
    static T tangent_scale(const LawConstants& c, const Block<T>& f, const Block<T>& cof, const T& det) noexcept {
        const T offset = det - c.rest_volume;
        return 2.0 * c.mu + c.lambda * (contraction(cof, cof) + 0.5 * (offset * offset + contraction(f, f)));
    }
    /// Shifted to 0 at rest; the differences are taken before the logarithm, so that small strains keep their digits.
    static double energy(const LawConstants& c, const Block<double>& f, double det) noexcept {
        const double size_sq = contraction(f, f);
        return 0.5 * c.mu * ((size_sq - 3.0) - natural_log(0.25 * (size_sq + 1.0))) +
               0.5 * c.lambda * (det - 1.0) * (det + 1.0 - 2.0 * c.rest_volume);
    }
};

/// Viscous first Piola-Kirchhoff stress F (2 viscosity dE/dt), dE/dt = sym(F^T dF/dt): none in rigid motion.
template <class T>
[[nodiscard]] inline Block<T> viscous_stress(double viscosity, const Block<T>& f, const Block<T>& rate) noexcept {
    const Block<T> cross = transposed_product(f, rate);
    Block<T> s;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) s.m[3 * i + j] = viscosity * (cross.m[3 * i + j] + cross.m[3 * j + i]);
    return product(f, s);
}

} // namespace seldinger::fem
