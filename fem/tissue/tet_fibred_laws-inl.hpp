// Mooney-Rivlin, Ogden and Holzapfel-Gasser-Ogden for a vector of tets: energies, stresses and their derivatives. The densities are
// explained in laws.hpp. Translated once for every instruction set by tet_kernels.cpp and measure_kernels.cpp.
#if defined(TROCAR_FEM_TET_FIBRED_LAWS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef TROCAR_FEM_TET_FIBRED_LAWS_INL
#undef TROCAR_FEM_TET_FIBRED_LAWS_INL
#else
#define TROCAR_FEM_TET_FIBRED_LAWS_INL
#endif

#include "fem/tissue/tet_functions-inl.hpp"
#include "fem/tissue/tet_laws-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace trocar::fem::HWY_NAMESPACE {

/// P d of a second stress S with derivative dS: d S + F dS.
HWY_INLINE M3 along_second(const M3& f, const M3& d, const Sym& s, const Sym& ds) { return mul_add(d, s, mul(f, ds)); }

/// lambda (J - a) cof F, its derivative and its energy less that at rest.
HWY_INLINE M3 volume_stress(const Constants& c, const M3& cof, V det) {
    return scaled(cof, hn::Mul(c.lambda, hn::Sub(det, c.rest_volume)));
}
HWY_INLINE M3 volume_stress_along(const Constants& c, const M3& f, const M3& cof, V det, const M3& d) {
    const V pressure = hn::Mul(c.lambda, hn::Sub(det, c.rest_volume)), growth = hn::Mul(c.lambda, contract(cof, d));
    return scaled_add(cof, growth, scaled(cofactors_along(f, d), pressure));
}
HWY_INLINE V volume_energy(const LawConstants& c, V det) {
    return hn::Mul(set(0.5 * c.lambda), hn::Mul(hn::Sub(det, set(1.0)), hn::Sub(hn::Add(det, set(1.0)), set(2.0 * c.rest_volume))));
}
/// Bound on what the volume adds to the tangent: lambda (|F| |J - a| + |cof F|^2).
HWY_INLINE V volume_tangent(const Constants& c, V size_sq, V det) {
    const V offset = hn::Sub(det, c.rest_volume);
    return hn::Mul(c.lambda, fma(set(0.5), fma(offset, offset, size_sq), hn::Mul(hn::Mul(size_sq, size_sq), set(1.0 / 3.0))));
}
HWY_INLINE Sym times(const Sym& s, V a) {
    return {hn::Mul(s.xx, a), hn::Mul(s.yy, a), hn::Mul(s.zz, a), hn::Mul(s.xy, a), hn::Mul(s.xz, a), hn::Mul(s.yz, a)};
}
HWY_INLINE Sym add_identity(const Sym& s, V a) { return {hn::Add(s.xx, a), hn::Add(s.yy, a), hn::Add(s.zz, a), s.xy, s.xz, s.yz}; }
/// F^T d + d^T F
HWY_INLINE Sym rate_of_gram(const M3& f, const M3& d) { return viscous_second_stress(set(1.0), f, d); }

/// S = 2 c10 + 2 c01 (tr C - C)
struct MooneyRivlinLanes {
    static constexpr bool kTurns = false;
    static HWY_INLINE Sym second_stress(const Constants& c, const Sym& g) {
        const V first = hn::Mul(set(2.0 * c.law->c10), c.factor), second = hn::Mul(set(2.0 * c.law->c01), c.factor);
        const V trace = hn::Add(hn::Add(g.xx, g.yy), g.zz);
        return add_identity(times(g, hn::Neg(second)), fma(second, trace, first));
    }
    static HWY_INLINE M3 stress(const Constants& c, const M3& f, const M3& cof, V det, V& tangent) {
        const V size_sq = contract(f, f);
        tangent = hn::Add(fma(set(12.0 * c.law->c01), size_sq, set(2.0 * c.law->c10)), volume_tangent(c, size_sq, det));
        return mul_add(f, second_stress(c, gram(f)), volume_stress(c, cof, det));
    }
    static HWY_INLINE M3 stress_along(const Constants& c, const M3& f, const M3& cof, V det, const M3& d) {
        const Sym rate = rate_of_gram(f, d);
        const V second = hn::Mul(set(2.0 * c.law->c01), c.factor), trace = hn::Add(hn::Add(rate.xx, rate.yy), rate.zz);
        const Sym ds = add_identity(times(rate, hn::Neg(second)), hn::Mul(second, trace));
        return scaled_add(along_second(f, d, second_stress(c, gram(f)), ds), set(1.0), volume_stress_along(c, f, cof, det, d));
    }
    static HWY_INLINE V energy(const LawConstants& c, const FibreBatch*, std::size_t, const M3& f, V det) {
        const Sym g = gram(f);
        const V trace = hn::Add(hn::Add(g.xx, g.yy), g.zz);
        const V cross = dot(g.xy, g.xy, g.xz, g.xz, g.yz, g.yz), square = fma(set(2.0), cross, dot(g.xx, g.xx, g.yy, g.yy, g.zz, g.zz));
        const V second = hn::Mul(set(0.5), fms(trace, trace, square));
        return fma(set(c.c10), hn::Sub(trace, set(3.0)), fma(set(c.c01), hn::Sub(second, set(3.0)), volume_energy(c, det)));
    }
};

/// S = sum_i 2 g'(c_i) n_i n_i^T with the eigenvalues c_i of C; g as laws.hpp's OgdenCurve.
struct OgdenLanes {
    static constexpr bool kTurns = false;
    /// At a squared stretch: 2 g' and 2 g''; steep: 2 g'' that does not jump where the range ends, for bounds.
    struct Slope {
        V value, slope, steep;
    };
    static HWY_INLINE Slope find_slope(const LawConstants& law, V square) {
        const V inside = hn::Max(hn::Min(square, set(kMostOgdenSquare)), set(kLeastOgdenSquare));
        const V log = natural_log(inside), per_inside = hn::Div(set(1.0), inside);
        Slope sum{hn::Zero(D8()), hn::Zero(D8()), hn::Zero(D8())};
        for (int k = 0; k < law.ogden_terms; ++k) {
            const double power = 0.5 * law.ogden_alpha[k] - 1.0;
            const V value = hn::Mul(set(law.ogden_mu[k]), natural_exp(hn::Mul(set(power), log)));
            sum.value = hn::Add(sum.value, value);
            sum.slope = fma(hn::Mul(value, set(power)), per_inside, sum.slope);
        }
        sum.steep = sum.slope;
        sum.slope = hn::IfThenZeroElse(hn::Lt(square, set(kLeastOgdenSquare)), sum.slope);
        sum.value = fma(sum.slope, hn::Sub(square, inside), sum.value);
        return sum;
    }
    static HWY_INLINE M3 stress(const Constants& c, const M3& f, const M3& cof, V det, V& tangent) {
        const Spectrum spectrum = find_spectrum(gram(f));
        V value[3], stiffest = set(0.0);
        TROCAR_UNROLL for (int i = 0; i < 3; ++i) {
            const Slope at = find_slope(*c.law, spectrum.value[i]);
            value[i] = hn::Mul(at.value, c.factor);
            stiffest = hn::Max(stiffest, fma(hn::Mul(set(2.0), hn::Abs(at.steep)), spectrum.value[i], hn::Abs(at.value)));
        }
        const V size_sq = contract(f, f);
        tangent = hn::Add(stiffest, volume_tangent(c, size_sq, det));
        return mul_add(f, compose(value, spectrum.vectors), volume_stress(c, cof, det));
    }
    static HWY_INLINE M3 stress_along(const Constants& c, const M3& f, const M3& cof, V det, const M3& d) {
        const Spectrum spectrum = find_spectrum(gram(f));
        const M3& n = spectrum.vectors;
        const Sym r = rate_of_gram(f, d);
        const M3 rate{{r.xx, r.xy, r.xz, r.xy, r.yy, r.yz, r.xz, r.yz, r.zz}};
        M3 turned = mul(tmul(n, rate), n); // in the eigenvectors' frame
        V value[3], slope[3];
        TROCAR_UNROLL for (int i = 0; i < 3; ++i) {
            const Slope at = find_slope(*c.law, spectrum.value[i]);
            value[i] = hn::Mul(at.value, c.factor);
            slope[i] = hn::Mul(at.steep, c.factor); // below the range as at its end: a bound, as HgoLanes'
        }
        TROCAR_UNROLL for (int i = 0; i < 3; ++i) TROCAR_UNROLL for (int j = 0; j < 3; ++j) {
            const V gap = hn::Sub(spectrum.value[i], spectrum.value[j]);
            const V scale = hn::Add(hn::Abs(spectrum.value[i]), hn::Abs(spectrum.value[j]));
            const auto apart = hn::Gt(hn::Abs(gap), hn::Mul(set(1e-6), scale));
            const V chord = hn::Div(hn::Sub(value[i], value[j]), hn::IfThenElse(apart, gap, set(1.0)));
            const V mean = hn::Mul(set(0.5), hn::Add(slope[i], slope[j]));
            turned.m[3 * i + j] = hn::Mul(turned.m[3 * i + j], hn::IfThenElse(apart, chord, mean));
        }
        const M3 back = mult(mul(n, turned), n);
        const Sym ds{back.m[0], back.m[4], back.m[8], back.m[1], back.m[2], back.m[5]};
        return scaled_add(along_second(f, d, compose(value, n), ds), set(1.0), volume_stress_along(c, f, cof, det, d));
    }
    static HWY_INLINE V energy(const LawConstants& c, const FibreBatch*, std::size_t, const M3& f, V det) {
        const Spectrum spectrum = find_spectrum(gram(f));
        V sum = volume_energy(c, det);
        TROCAR_UNROLL for (int i = 0; i < 3; ++i) {
            const V inside = hn::Max(hn::Min(spectrum.value[i], set(kMostOgdenSquare)), set(kLeastOgdenSquare));
            const V log = natural_log(inside), beyond = hn::Sub(spectrum.value[i], inside);
            const Slope at = find_slope(c, spectrum.value[i]);
            // the quadratic through the range's end; find_slope's value is taken at the far side
            sum = fma(hn::Mul(set(0.5), beyond), fnma(hn::Mul(set(0.5), at.slope), beyond, at.value), sum);
            for (int k = 0; k < c.ogden_terms; ++k)
                sum = fma(set(c.ogden_mu[k] / c.ogden_alpha[k]), hn::Sub(natural_exp(hn::Mul(set(0.5 * c.ogden_alpha[k]), log)), set(1.0)),
                          sum);
        }
        return sum;
    }
};

/// A neo-Hookean ground and two families of fibres.
struct HgoLanes {
    static constexpr bool kTurns = false;
    /// Of a family: the energy's first and second derivative by its stretch strain; steep: the second as if fibres held in compression too,
    /// which does not jump.
    struct Fibre {
        V first, second, steep;
    };
    static HWY_INLINE Fibre find_fibre(const LawConstants& law, V strain) {
        const V most = set(law.fibre_limit), inside = hn::Max(hn::Min(strain, most), hn::Zero(D8()));
        const V square = hn::Mul(inside, inside);
        const V per = hn::Mul(set(law.k1), natural_exp(hn::Mul(set(law.k2), square)));
        const V steep = hn::Mul(per, fma(set(2.0 * law.k2), square, set(1.0)));
        V first = hn::Mul(per, inside);
        const V beyond = hn::Max(hn::Sub(strain, most), hn::Zero(D8()));
        first = fma(steep, beyond, first);
        return {first, hn::IfThenElseZero(hn::Gt(strain, hn::Zero(D8())), steep), steep};
    }
    struct Axis {
        V x, y, z;
    };
    static HWY_INLINE Axis load_axis(const FibreBatch* fibres, int family, std::size_t lane) {
        return {hn::Load(D8(), fibres->axis[3 * family] + lane), hn::Load(D8(), fibres->axis[3 * family + 1] + lane),
                hn::Load(D8(), fibres->axis[3 * family + 2] + lane)};
    }
    static HWY_INLINE V along_axis(const Sym& s, const Axis& a) {
        const V diagonal = dot(hn::Mul(s.xx, a.x), a.x, hn::Mul(s.yy, a.y), a.y, hn::Mul(s.zz, a.z), a.z);
        const V beside = dot(hn::Mul(s.xy, a.x), a.y, hn::Mul(s.xz, a.x), a.z, hn::Mul(s.yz, a.y), a.z);
        return fma(set(2.0), beside, diagonal);
    }
    static HWY_INLINE V strain_of(const LawConstants& law, const Sym& g, const Axis& a) {
        const V trace = hn::Add(hn::Add(g.xx, g.yy), g.zz);
        return fma(set(law.kappa), hn::Sub(trace, set(3.0)), hn::Mul(set(1.0 - 3.0 * law.kappa), hn::Sub(along_axis(g, a), set(1.0))));
    }
    /// s += b (kappa I + (1 - 3 kappa) a a^T)
    static HWY_INLINE void add_structure(const LawConstants& law, const Axis& a, V b, Sym& s) {
        const V round = hn::Mul(set(law.kappa), b), straight = hn::Mul(set(1.0 - 3.0 * law.kappa), b);
        const V x = hn::Mul(straight, a.x), y = hn::Mul(straight, a.y), z = hn::Mul(straight, a.z);
        s = {hn::Add(fma(x, a.x, s.xx), round),
             hn::Add(fma(y, a.y, s.yy), round),
             hn::Add(fma(z, a.z, s.zz), round),
             fma(x, a.y, s.xy),
             fma(x, a.z, s.xz),
             fma(y, a.z, s.yz)};
    }
    static HWY_INLINE Sym no_stress() {
        const V zero = hn::Zero(D8());
        return {zero, zero, zero, zero, zero, zero};
    }
    static HWY_INLINE M3 stress(const Constants& c, const M3& f, const M3& cof, V det, V& tangent) {
        const M3 ground = NeoHookeanLanes::stress(c, f, cof, det, tangent);
        const Sym g = gram(f);
        Sym s = no_stress();
        const V size_sq = contract(f, f);
        for (int family = 0; family < 2; ++family) {
            const Axis a = load_axis(c.fibres, family, c.lane);
            const Fibre fibre = find_fibre(*c.law, strain_of(*c.law, g, a));
            add_structure(*c.law, a, hn::Mul(hn::Add(fibre.first, fibre.first), c.factor), s);
            tangent = hn::Add(tangent, fma(hn::Mul(set(4.0), fibre.steep), size_sq, hn::Add(fibre.first, fibre.first)));
        }
        return mul_add(f, s, ground);
    }
    /// Of slack fibres as if they held: the stable step must bear that they do so at once.
    static HWY_INLINE M3 stress_along(const Constants& c, const M3& f, const M3& cof, V det, const M3& d) {
        const M3 ground = NeoHookeanLanes::stress_along(c, f, cof, det, d);
        const Sym g = gram(f), rate = rate_of_gram(f, d);
        Sym s = no_stress(), ds = no_stress();
        const V trace = hn::Add(hn::Add(rate.xx, rate.yy), rate.zz);
        for (int family = 0; family < 2; ++family) {
            const Axis a = load_axis(c.fibres, family, c.lane);
            const Fibre fibre = find_fibre(*c.law, strain_of(*c.law, g, a));
            const V along = fma(set(c.law->kappa), trace, hn::Mul(set(1.0 - 3.0 * c.law->kappa), along_axis(rate, a)));
            add_structure(*c.law, a, hn::Mul(hn::Add(fibre.first, fibre.first), c.factor), s);
            add_structure(*c.law, a, hn::Mul(hn::Mul(hn::Add(fibre.steep, fibre.steep), along), c.factor), ds);
        }
        return scaled_add(along_second(f, d, s, ds), set(1.0), ground);
    }
    static HWY_INLINE V fibre_energy(const LawConstants& law, V strain) {
        const V inside = hn::Max(hn::Min(strain, set(law.fibre_limit)), hn::Zero(D8()));
        const V beyond = hn::Max(hn::Sub(strain, set(law.fibre_limit)), hn::Zero(D8()));
        const Fibre end = find_fibre(law, inside);
        const V square = hn::Mul(inside, inside), exponent = hn::Mul(set(law.k2), square);
        const V large = hn::Mul(set(0.5 * law.k1 / law.k2), hn::Sub(natural_exp(exponent), set(1.0)));
        const V series = fma(exponent, fma(exponent, fma(exponent, set(1.0 / 24.0), set(1.0 / 6.0)), set(0.5)), set(1.0));
        const V small = hn::Mul(hn::Mul(set(0.5 * law.k1), square), series);
        const V stored = hn::IfThenElse(hn::Gt(exponent, set(kSmallExponent)), large, small);
        return fma(beyond, fma(hn::Mul(set(0.5), end.second), beyond, end.first), stored);
    }
    static HWY_INLINE V energy(const LawConstants& c, const FibreBatch* fibres, std::size_t lane, const M3& f, V det) {
        const V size_sq = contract(f, f);
        const V shear = hn::Sub(hn::Sub(size_sq, set(3.0)), natural_log(hn::Mul(set(0.25), hn::Add(size_sq, set(1.0)))));
        V sum = fma(set(0.5 * c.mu), shear, volume_energy(c, det));
        const Sym g = gram(f);
        for (int family = 0; family < 2; ++family) sum = hn::Add(sum, fibre_energy(c, strain_of(c, g, load_axis(fibres, family, lane))));
        return sum;
    }
};

/// Such a law of tets that stand for themselves.
template <class Law>
struct Alone : Law {
    template <bool kViscous>
    static HWY_INLINE Response respond(const TetBatch& batch, std::size_t lane, const TetJob& job, V factor, const M3& edges,
                                       const NodeRecord* records, const FibreBatch* fibres) {
        const M3 inverse = load_inverse(batch, lane), f = mul(edges, inverse), cof = cofactors(f);
        const V det = determinant(f, cof), size_sq = contract(f, f);
        V tangent;
        M3 stress = scaled(Law::stress(Constants(job.constants, set(1.0), fibres, lane), f, cof, det, tangent), factor);
        if constexpr (kViscous) stress = mul_add(f, find_drag(batch, lane, job, factor, inverse, f, records), stress);
        return {mult(stress, inverse), det, tangent, size_sq};
    }
};

} // namespace trocar::fem::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
