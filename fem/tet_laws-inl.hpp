// Stress and its derivative of a vector of tets, for every law. Translated once for every instruction set by tet_kernels.cpp.
#if defined(SELDINGER_FEM_TET_LAWS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef SELDINGER_FEM_TET_LAWS_INL
#undef SELDINGER_FEM_TET_LAWS_INL
#else
#define SELDINGER_FEM_TET_LAWS_INL
#endif

#include "fem/polar.hpp"
#include "fem/tet_lanes-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace seldinger::fem::HWY_NAMESPACE {

/// A law's constants in every lane.
struct Constants {
    V mu, lambda, rest_volume;
    HWY_INLINE explicit Constants(const LawConstants& c) : mu(set(c.mu)), lambda(set(c.lambda)), rest_volume(set(c.rest_volume)) {}
};

/// St. Venant-Kirchhoff, S = lambda tr(E) I + 2 mu E with E = (F^T F - I)/2, P = F S.
struct StVKLanes {
    static HWY_INLINE M3 second_stress(const Constants& c, const M3& f) {
        M3 s = tmul(f, f);
        const V trace = hn::Sub(hn::Add(hn::Add(s.m[0], s.m[4]), s.m[8]), set(3.0));
        const V pressure = fms(hn::Mul(set(0.5), c.lambda), trace, c.mu);
        SELDINGER_UNROLL for (int i = 0; i < 9; ++i) s.m[i] = i % 4 == 0 ? fma(c.mu, s.m[i], pressure) : hn::Mul(c.mu, s.m[i]);
        return s;
    }
    static HWY_INLINE M3 stress(const Constants& c, const M3& f, const M3&, V) { return mul(f, second_stress(c, f)); }
    static HWY_INLINE M3 stress_along(const Constants& c, const M3& f, const M3&, V, const M3& d) {
        const M3 cross = tmul(f, d);
        const V trace = hn::Mul(c.lambda, hn::Add(hn::Add(cross.m[0], cross.m[4]), cross.m[8]));
        M3 rate;
        SELDINGER_UNROLL for (int i = 0; i < 3; ++i)
            SELDINGER_UNROLL for (int j = 0; j < 3; ++j) {
                const V both = hn::Add(cross.m[3 * i + j], cross.m[3 * j + i]);
                rate.m[3 * i + j] = i == j ? fma(c.mu, both, trace) : hn::Mul(c.mu, both);
            }
        const M3 a = mul(d, second_stress(c, f)), b = mul(f, rate);
        M3 sum;
        SELDINGER_UNROLL for (int i = 0; i < 9; ++i) sum.m[i] = hn::Add(a.m[i], b.m[i]);
        return sum;
    }
    /// Scale of the tangent's largest eigenvalue, Pa: compared with itself only, to see a tet stiffen.
    static HWY_INLINE V tangent_scale(const Constants& c, const M3& f, const M3&, V) {
        return hn::Mul(fma(set(2.0), c.mu, c.lambda), contract(f, f));
    }
};

/// Corotational: linear elasticity in the frame that turns with the tet, P = 2 mu (F - R) + lambda tr(R^T F - I) R.
struct CorotationalLanes {
    static HWY_INLINE M3 find_rotation(const M3& f) {
        alignas(64) double lanes[9][kLanes];
        for (int i = 0; i < 9; ++i) hn::Store(f.m[i], D8(), lanes[i]);
        for (std::size_t lane = 0; lane < kLanes; ++lane) {
            Block<double> one;
            for (int i = 0; i < 9; ++i) one.m[i] = lanes[i][lane];
            one = nearest_rotation(one);
            for (int i = 0; i < 9; ++i) lanes[i][lane] = one.m[i];
        }
        M3 rotation;
        for (int i = 0; i < 9; ++i) rotation.m[i] = hn::Load(D8(), lanes[i]);
        return rotation;
    }
    static HWY_INLINE V pressure(const Constants& c, const M3& f, const M3& r) {
        return fms(c.lambda, hn::Sub(contract(r, f), set(3.0)), hn::Add(c.mu, c.mu));
    }
    static HWY_INLINE M3 stress(const Constants& c, const M3& f, const M3&, V) {
        const M3 r = find_rotation(f);
        return scaled_add(f, hn::Add(c.mu, c.mu), scaled(r, pressure(c, f, r)));
    }
    static HWY_INLINE M3 stress_along(const Constants& c, const M3& f, const M3&, V, const M3& d) {
        const M3 r = find_rotation(f);
        const V growth = hn::Mul(c.lambda, contract(r, d));
        return scaled_add(d, hn::Add(c.mu, c.mu), scaled_add(r, growth, scaled(rotation_along(f, r, d), pressure(c, f, r))));
    }
    /// Linear in stretch: it never stiffens.
    static HWY_INLINE V tangent_scale(const Constants& c, const M3&, const M3&, V) { return fma(set(2.0), c.mu, c.lambda); }
    /// dR = R [w]x with (tr(S) I - S) w = axial(R^T d - d^T R), S = R^T F.
    static HWY_INLINE M3 rotation_along(const M3& f, const M3& r, const M3& d) {
        M3 g = tmul(r, f);
        const M3 a = tmul(r, d);
        const V trace = hn::Add(hn::Add(g.m[0], g.m[4]), g.m[8]);
        SELDINGER_UNROLL for (int i = 0; i < 9; ++i) g.m[i] = i % 4 == 0 ? hn::Sub(trace, g.m[i]) : hn::Neg(g.m[i]);
        const M3 cof = cofactors(g);
        const V volume = determinant(g, cof), least = set(1e-6); // an exactly mirrored tet turns infinitely fast: cap it
        const V per_volume = hn::Div(set(1.0), hn::IfThenElse(hn::Gt(volume, least), volume, least));
        const V axial[3] = {hn::Sub(a.m[7], a.m[5]), hn::Sub(a.m[2], a.m[6]), hn::Sub(a.m[3], a.m[1])};
        V w[3];
        SELDINGER_UNROLL for (int i = 0; i < 3; ++i)
            w[i] = hn::Mul(dot(cof.m[i], axial[0], cof.m[3 + i], axial[1], cof.m[6 + i], axial[2]), per_volume);
        const V zero = hn::Zero(D8());
        return mul(r, M3{{zero, hn::Neg(w[2]), w[1], w[2], zero, hn::Neg(w[0]), hn::Neg(w[1]), w[0], zero}});
    }
};

/// Stable neo-Hookean, P = mu I/(I + 1) F + lambda (J - alpha) cof F, I = |F|^2: smooth through inversion.
struct NeoHookeanLanes {
    static HWY_INLINE M3 stress(const Constants& c, const M3& f, const M3& cof, V det) {
        const V grown = hn::Add(contract(f, f), set(1.0));
        const V shear = hn::Sub(c.mu, hn::Div(c.mu, grown));
        return scaled_add(f, shear, scaled(cof, hn::Mul(c.lambda, hn::Sub(det, c.rest_volume))));
    }
    static HWY_INLINE M3 stress_along(const Constants& c, const M3& f, const M3& cof, V det, const M3& d) {
        const V per_grown = hn::Div(set(1.0), hn::Add(contract(f, f), set(1.0)));
        const V shear = fnma(c.mu, per_grown, c.mu);
        const V along = hn::Mul(hn::Mul(hn::Add(c.mu, c.mu), contract(f, d)), hn::Mul(per_grown, per_grown));
        const V pressure = hn::Mul(c.lambda, hn::Sub(det, c.rest_volume)), growth = hn::Mul(c.lambda, contract(cof, d));
        return scaled_add(d, shear, scaled_add(f, along, scaled_add(cof, growth, scaled(cofactors_along(f, d), pressure))));
    }
    static HWY_INLINE V tangent_scale(const Constants& c, const M3& f, const M3& cof, V det) {
        const V offset = hn::Sub(det, c.rest_volume);
        const V inner = fma(set(0.5), fma(offset, offset, contract(f, f)), contract(cof, cof));
        return fma(c.lambda, inner, hn::Add(c.mu, c.mu));
    }
};

/// Viscous first Piola-Kirchhoff stress F viscosity (F^T dF + dF^T F): none in rigid motion.
HWY_INLINE M3 viscous_second_stress(V viscosity, const M3& f, const M3& rate) {
    const M3 cross = tmul(f, rate);
    M3 s;
    SELDINGER_UNROLL for (int i = 0; i < 3; ++i)
        SELDINGER_UNROLL for (int j = 0; j < 3; ++j)
            s.m[3 * i + j] = hn::Mul(viscosity, hn::Add(cross.m[3 * i + j], cross.m[3 * j + i]));
    return s;
}

} // namespace seldinger::fem::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
