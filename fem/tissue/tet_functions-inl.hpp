// Logarithm, exponential and the eigenvectors of symmetric matrices of a vector of tets: the same bits on every instruction set.
#if defined(TROCAR_FEM_TET_FUNCTIONS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef TROCAR_FEM_TET_FUNCTIONS_INL
#undef TROCAR_FEM_TET_FUNCTIONS_INL
#else
#define TROCAR_FEM_TET_FUNCTIONS_INL
#endif

#include "fem/tissue/exponential.hpp"
#include "fem/tissue/tet_lanes-inl.hpp"

#include <limits>

HWY_BEFORE_NAMESPACE();
namespace trocar::fem::HWY_NAMESPACE {

/// logarithm.hpp's, for every lane.
HWY_INLINE V natural_log(V x) {
    const hn::RebindToUnsigned<D8> du;
    const auto bits = hn::BitCast(du, x);
    const auto fine = hn::And(hn::Ge(x, set(std::numeric_limits<double>::min())), hn::Lt(x, set(std::numeric_limits<double>::infinity())));
    constexpr double kTwo52 = 4503599627370496.0; // an integer in its lowest bits is that integer more
    V exponent = hn::Sub(hn::BitCast(D8(), hn::Or(hn::ShiftRight<52>(bits), hn::BitCast(du, set(kTwo52)))), set(kTwo52 + 1023.0));
    V m = hn::BitCast(D8(), hn::Or(hn::And(bits, hn::Set(du, 0x000fffffffffffffULL)), hn::BitCast(du, set(1.0))));
    const auto high = hn::Gt(m, set(1.4142135623730951));
    m = hn::IfThenElse(high, hn::Mul(m, set(0.5)), m);
    exponent = hn::IfThenElse(high, hn::Add(exponent, set(1.0)), exponent);
    const V s = hn::Div(hn::Sub(m, set(1.0)), hn::Add(m, set(1.0))), z = hn::Mul(s, s), twice = hn::Add(s, s);
    V series = set(0.0);
    for (int k = 21; k >= 3; k -= 2) series = hn::Mul(hn::Add(series, set(1.0 / k)), z);
    const V tail = hn::Add(hn::Mul(twice, series), hn::Mul(exponent, set(1.90821492927058770002e-10)));
    const V log = hn::Add(hn::Mul(exponent, set(0.693147180369123816490)), hn::Add(twice, tail));
    return hn::IfThenElse(fine, log, set(std::numeric_limits<double>::quiet_NaN()));
}

/// exponential.hpp's, for every lane.
HWY_INLINE V natural_exp(V argument) {
    const hn::RebindToUnsigned<D8> du;
    const V x = hn::Max(hn::Min(argument, set(kMostExponent)), set(-kMostExponent));
    constexpr double kMagic = 6755399441055744.0;
    const V shifted = hn::Add(hn::Mul(x, set(1.4426950408889634)), set(kMagic)), count = hn::Sub(shifted, set(kMagic));
    const V r = fma(count, set(-1.90821492927058770002e-10), fma(count, set(-0.693147180369123816490), x));
    V series = set(1.0 / 87178291200.0);
    double factorial = 87178291200.0;
    for (int k = 14; k >= 1; --k) {
        factorial /= k;
        series = fma(series, r, set(1.0 / factorial));
    }
    const auto bits = hn::ShiftLeft<52>(hn::Add(hn::BitCast(du, shifted), hn::Set(du, 1023)));
    return hn::Mul(series, hn::BitCast(D8(), bits));
}

/// Of a symmetric matrix: its eigenvalues, and its eigenvectors as columns.
struct Spectrum {
    V value[3];
    M3 vectors;
};

/// Cyclic Jacobi: from any matrix kJacobiSweeps leave nothing off the diagonal that a double shows.
inline constexpr int kJacobiSweeps = 6;
HWY_INLINE Spectrum find_spectrum(const Sym& s) {
    V a[3][3] = {{s.xx, s.xy, s.xz}, {s.xy, s.yy, s.yz}, {s.xz, s.yz, s.zz}};
    Spectrum result;
    TROCAR_UNROLL for (int i = 0; i < 9; ++i) result.vectors.m[i] = set(i % 4 == 0 ? 1.0 : 0.0);
    constexpr int kPairs[3][3] = {{0, 1, 2}, {0, 2, 1}, {1, 2, 0}};
    for (int sweep = 0; sweep < kJacobiSweeps; ++sweep)
        for (const auto& pair : kPairs) {
            const int p = pair[0], q = pair[1], r = pair[2];
            const V off = a[p][q], gap = hn::Sub(a[q][q], a[p][p]), twice = hn::Add(off, off);
            const V root = hn::Sqrt(fma(gap, gap, hn::Mul(twice, twice)));
            const V below = hn::IfThenElse(hn::Lt(gap, hn::Zero(D8())), hn::Sub(gap, root), hn::Add(gap, root));
            const auto diagonal = hn::Eq(below, hn::Zero(D8()));
            const V t = hn::IfThenElse(diagonal, hn::Zero(D8()), hn::Div(twice, hn::IfThenElse(diagonal, set(1.0), below)));
            const V c = hn::Div(set(1.0), hn::Sqrt(fma(t, t, set(1.0)))), sine = hn::Mul(t, c);
            a[p][p] = fnma(t, off, a[p][p]);
            a[q][q] = fma(t, off, a[q][q]);
            a[p][q] = a[q][p] = hn::Zero(D8());
            const V rp = a[r][p], rq = a[r][q];
            a[r][p] = a[p][r] = fms(c, rp, hn::Mul(sine, rq));
            a[r][q] = a[q][r] = fma(sine, rp, hn::Mul(c, rq));
            TROCAR_UNROLL for (int k = 0; k < 3; ++k) {
                V &x = result.vectors.m[3 * k + p], &y = result.vectors.m[3 * k + q];
                const V before = x;
                x = fms(c, before, hn::Mul(sine, y));
                y = fma(sine, before, hn::Mul(c, y));
            }
        }
    TROCAR_UNROLL for (int i = 0; i < 3; ++i) result.value[i] = a[i][i];
    return result;
}

/// sum_i value_i n_i n_i^T
HWY_INLINE Sym compose(const V value[3], const M3& n) {
    const auto entry = [&](int i, int j) HWY_ATTR {
        return dot(hn::Mul(value[0], n.m[3 * i]), n.m[3 * j], hn::Mul(value[1], n.m[3 * i + 1]), n.m[3 * j + 1],
                   hn::Mul(value[2], n.m[3 * i + 2]), n.m[3 * j + 2]);
    };
    return {entry(0, 0), entry(1, 1), entry(2, 2), entry(0, 1), entry(0, 2), entry(1, 2)};
}

} // namespace trocar::fem::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
