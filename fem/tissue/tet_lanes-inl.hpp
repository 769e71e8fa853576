// Vectors of tets: eight, four or two doubles at once. Translated once for every instruction set by tet_kernels.cpp.
#include <hwy/highway.h>

#if defined(TROCAR_FEM_TET_LANES_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef TROCAR_FEM_TET_LANES_INL
#undef TROCAR_FEM_TET_LANES_INL
#else
#define TROCAR_FEM_TET_LANES_INL
#endif

#include "fem/tissue/force_plan.hpp"

#include <cmath>

HWY_BEFORE_NAMESPACE();
namespace trocar::fem::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using D8 = hn::CappedTag<double, kBatch>;
using V = hn::Vec<D8>;
inline constexpr std::size_t kLanes = hn::MaxLanes(D8());

HWY_INLINE V set(double value) { return hn::Set(D8(), value); }

#if HWY_ARCH_X86 && HWY_TARGET > HWY_AVX2
// No instruction for it here: the library's fma keeps the bits.
template <class F>
HWY_INLINE V by_lane(V a, V b, V c, F&& f) {
    alignas(64) double x[kLanes], y[kLanes], z[kLanes];
    hn::Store(a, D8(), x);
    hn::Store(b, D8(), y);
    hn::Store(c, D8(), z);
    for (std::size_t i = 0; i < kLanes; ++i) x[i] = f(x[i], y[i], z[i]);
    return hn::Load(D8(), x);
}
/// a b + c, -a b + c, a b - c: rounded once.
HWY_INLINE V fma(V a, V b, V c) {
    return by_lane(a, b, c, [](double x, double y, double z) { return std::fma(x, y, z); });
}
HWY_INLINE V fnma(V a, V b, V c) {
    return by_lane(a, b, c, [](double x, double y, double z) { return std::fma(-x, y, z); });
}
HWY_INLINE V fms(V a, V b, V c) {
    return by_lane(a, b, c, [](double x, double y, double z) { return std::fma(x, y, -z); });
}
#else
/// a b + c, -a b + c, a b - c: rounded once.
HWY_INLINE V fma(V a, V b, V c) { return hn::MulAdd(a, b, c); }
HWY_INLINE V fnma(V a, V b, V c) { return hn::NegMulAdd(a, b, c); }
HWY_INLINE V fms(V a, V b, V c) { return hn::MulSub(a, b, c); }
#endif

/// 3x3 of vectors, row-major.
struct M3 {
    V m[9];
};

#define TROCAR_UNROLL _Pragma("GCC unroll 9")

/// sum_k a[k] b[k]
HWY_INLINE V dot(V a0, V b0, V a1, V b1, V a2, V b2) { return fma(a2, b2, fma(a1, b1, hn::Mul(a0, b0))); }

/// Symmetric 3x3.
struct Sym {
    V xx, yy, zz, xy, xz, yz;
};

/// f^T f
HWY_INLINE Sym gram(const M3& f) {
    const auto entry = [&](int i, int j) HWY_ATTR { return dot(f.m[i], f.m[j], f.m[3 + i], f.m[3 + j], f.m[6 + i], f.m[6 + j]); };
    return {entry(0, 0), entry(1, 1), entry(2, 2), entry(0, 1), entry(0, 2), entry(1, 2)};
}
/// a s, a s + b
HWY_INLINE M3 mul(const M3& a, const Sym& s) {
    M3 c;
    TROCAR_UNROLL for (int i = 0; i < 9; i += 3) {
        c.m[i] = dot(a.m[i], s.xx, a.m[i + 1], s.xy, a.m[i + 2], s.xz);
        c.m[i + 1] = dot(a.m[i], s.xy, a.m[i + 1], s.yy, a.m[i + 2], s.yz);
        c.m[i + 2] = dot(a.m[i], s.xz, a.m[i + 1], s.yz, a.m[i + 2], s.zz);
    }
    return c;
}
HWY_INLINE M3 mul_add(const M3& a, const Sym& s, const M3& b) {
    M3 c;
    TROCAR_UNROLL for (int i = 0; i < 9; i += 3) {
        c.m[i] = fma(a.m[i + 2], s.xz, fma(a.m[i + 1], s.xy, fma(a.m[i], s.xx, b.m[i])));
        c.m[i + 1] = fma(a.m[i + 2], s.yz, fma(a.m[i + 1], s.yy, fma(a.m[i], s.xy, b.m[i + 1])));
        c.m[i + 2] = fma(a.m[i + 2], s.zz, fma(a.m[i + 1], s.yz, fma(a.m[i], s.xz, b.m[i + 2])));
    }
    return c;
}

/// a b, a^T b, a b^T
HWY_INLINE M3 mul(const M3& a, const M3& b) {
    M3 c;
    TROCAR_UNROLL for (int i = 0; i < 3; ++i) TROCAR_UNROLL for (int j = 0; j < 3; ++j) c.m[3 * i + j] =
        dot(a.m[3 * i], b.m[j], a.m[3 * i + 1], b.m[3 + j], a.m[3 * i + 2], b.m[6 + j]);
    return c;
}
HWY_INLINE M3 tmul(const M3& a, const M3& b) {
    M3 c;
    TROCAR_UNROLL for (int i = 0; i < 3; ++i) TROCAR_UNROLL for (int j = 0; j < 3; ++j) c.m[3 * i + j] =
        dot(a.m[i], b.m[j], a.m[3 + i], b.m[3 + j], a.m[6 + i], b.m[6 + j]);
    return c;
}
HWY_INLINE M3 mult(const M3& a, const M3& b) {
    M3 c;
    TROCAR_UNROLL for (int i = 0; i < 3; ++i) TROCAR_UNROLL for (int j = 0; j < 3; ++j) c.m[3 * i + j] =
        dot(a.m[3 * i], b.m[3 * j], a.m[3 * i + 1], b.m[3 * j + 1], a.m[3 * i + 2], b.m[3 * j + 2]);
    return c;
}
/// sum_ij a_ij b_ij, row by row: three short chains instead of one of nine
HWY_INLINE V contract(const M3& a, const M3& b) {
    const auto row = [&](int i) HWY_ATTR { return dot(a.m[i], b.m[i], a.m[i + 1], b.m[i + 1], a.m[i + 2], b.m[i + 2]); };
    return hn::Add(hn::Add(row(0), row(3)), row(6));
}
/// d det(a) / d a
HWY_INLINE M3 cofactors(const M3& a) {
    const V* f = a.m;
    const auto minor = [](V p, V q, V r, V s) HWY_ATTR { return fms(p, q, hn::Mul(r, s)); };
    return {{minor(f[4], f[8], f[5], f[7]), minor(f[5], f[6], f[3], f[8]), minor(f[3], f[7], f[4], f[6]), minor(f[2], f[7], f[1], f[8]),
             minor(f[0], f[8], f[2], f[6]), minor(f[1], f[6], f[0], f[7]), minor(f[1], f[5], f[2], f[4]), minor(f[2], f[3], f[0], f[5]),
             minor(f[0], f[4], f[1], f[3])}};
}
/// Directional derivative of cofactors(a) along b.
HWY_INLINE M3 cofactors_along(const M3& a, const M3& b) {
    M3 c;
    TROCAR_UNROLL for (int i = 0; i < 3; ++i) TROCAR_UNROLL for (int j = 0; j < 3; ++j) {
        const int r = (i + 1) % 3 * 3, s = (i + 2) % 3 * 3, p = (j + 1) % 3, q = (j + 2) % 3;
        c.m[3 * i + j] =
            fnma(b.m[r + q], a.m[s + p], fnma(a.m[r + q], b.m[s + p], fma(b.m[r + p], a.m[s + q], hn::Mul(a.m[r + p], b.m[s + q]))));
    }
    return c;
}
HWY_INLINE V determinant(const M3& f, const M3& cof) { return dot(f.m[0], cof.m[0], f.m[1], cof.m[1], f.m[2], cof.m[2]); }
HWY_INLINE M3 scaled(const M3& a, V s) {
    M3 c;
    TROCAR_UNROLL for (int i = 0; i < 9; ++i) c.m[i] = hn::Mul(a.m[i], s);
    return c;
}
/// s a + b
HWY_INLINE M3 scaled_add(const M3& a, V s, const M3& b) {
    M3 c;
    TROCAR_UNROLL for (int i = 0; i < 9; ++i) c.m[i] = fma(a.m[i], s, b.m[i]);
    return c;
}

/// Batches name records and slots by their distance in bytes from the first: no multiplication on the way.
HWY_INLINE const NodeRecord& record_at(const NodeRecord* records, Index bytes) {
    return *reinterpret_cast<const NodeRecord*>(reinterpret_cast<const char*>(records) + bytes);
}
HWY_INLINE double* slot_at(PartialForce* partial, Index bytes) {
    return reinterpret_cast<PartialForce*>(reinterpret_cast<char*>(partial) + bytes)->f;
}

/// Three numbers of each tet, one vector per axis.
struct Axes {
    V x, y, z;
};

#if HWY_TARGET == HWY_AVX3
using D4 = hn::Half<D8>;
HWY_INLINE V pick_low(V a, V b) { // [a0 a1 b0 b1 | a4 a5 b4 b5]
    return V{_mm512_permutex2var_pd(a.raw, _mm512_setr_epi64(0, 1, 8, 9, 4, 5, 12, 13), b.raw)};
}
HWY_INLINE V pick_high(V a, V b) { // [a2 a3 b2 b3 | a6 a7 b6 b7]
    return V{_mm512_permutex2var_pd(a.raw, _mm512_setr_epi64(2, 3, 10, 11, 6, 7, 14, 15), b.raw)};
}
/// Row i holds four numbers of tet i and four of tet i + 4.
struct Rows {
    V row[4];
};
HWY_INLINE Rows load_rows(const NodeRecord* records, const Index* node, bool second) {
    Rows rows;
    TROCAR_UNROLL for (int i = 0; i < 4; ++i) {
        const NodeRecord &low = record_at(records, node[i]), &high = record_at(records, node[i + 4]);
        rows.row[i] = hn::Combine(D8(), hn::Load(D4(), second ? high.v : high.x), hn::Load(D4(), second ? low.v : low.x));
    }
    return rows;
}
HWY_INLINE Rows subtract(const Rows& a, const Rows& b) {
    return {{hn::Sub(a.row[0], b.row[0]), hn::Sub(a.row[1], b.row[1]), hn::Sub(a.row[2], b.row[2]), hn::Sub(a.row[3], b.row[3])}};
}
HWY_INLINE Axes turn(const Rows& r) {
    const V low01 = hn::InterleaveLower(D8(), r.row[0], r.row[1]), low23 = hn::InterleaveLower(D8(), r.row[2], r.row[3]);
    const V high01 = hn::InterleaveUpper(D8(), r.row[0], r.row[1]), high23 = hn::InterleaveUpper(D8(), r.row[2], r.row[3]);
    return {pick_low(low01, low23), pick_low(high01, high23), pick_high(low01, low23)};
}
HWY_INLINE Rows turn_back(const Axes& f) {
    const V zero = hn::Zero(D8());
    const V low = hn::InterleaveLower(D8(), f.x, f.y), high = hn::InterleaveUpper(D8(), f.x, f.y);
    const V z_low = hn::InterleaveLower(D8(), f.z, zero), z_high = hn::InterleaveUpper(D8(), f.z, zero);
    return {{pick_low(low, z_low), pick_low(high, z_high), pick_high(low, z_low), pick_high(high, z_high)}};
}
#elif HWY_TARGET == HWY_AVX2
using D4 = D8;
struct Rows {
    V row[4];
}; // one tet each
HWY_INLINE Rows load_rows(const NodeRecord* records, const Index* node, bool second) {
    Rows rows;
    TROCAR_UNROLL for (int i = 0; i < 4; ++i) {
        const NodeRecord& record = record_at(records, node[i]);
        rows.row[i] = hn::Load(D4(), second ? record.v : record.x);
    }
    return rows;
}
HWY_INLINE Rows subtract(const Rows& a, const Rows& b) {
    return {{hn::Sub(a.row[0], b.row[0]), hn::Sub(a.row[1], b.row[1]), hn::Sub(a.row[2], b.row[2]), hn::Sub(a.row[3], b.row[3])}};
}
HWY_INLINE Axes turn(const Rows& r) {
    const V low01 = hn::InterleaveLower(D8(), r.row[0], r.row[1]), low23 = hn::InterleaveLower(D8(), r.row[2], r.row[3]);
    const V high01 = hn::InterleaveUpper(D8(), r.row[0], r.row[1]), high23 = hn::InterleaveUpper(D8(), r.row[2], r.row[3]);
    return {hn::ConcatLowerLower(D8(), low23, low01), hn::ConcatLowerLower(D8(), high23, high01), hn::ConcatUpperUpper(D8(), low23, low01)};
}
HWY_INLINE Rows turn_back(const Axes& f) {
    const V zero = hn::Zero(D8());
    const V low = hn::InterleaveLower(D8(), f.x, f.y), high = hn::InterleaveUpper(D8(), f.x, f.y);
    const V z_low = hn::InterleaveLower(D8(), f.z, zero), z_high = hn::InterleaveUpper(D8(), f.z, zero);
    return {{hn::ConcatLowerLower(D8(), z_low, low), hn::ConcatLowerLower(D8(), z_high, high), hn::ConcatUpperUpper(D8(), z_low, low),
             hn::ConcatUpperUpper(D8(), z_high, high)}};
}
#else
struct Rows {
    V x, y, z;
};
HWY_INLINE Rows load_rows(const NodeRecord* records, const Index* node, bool second) {
    alignas(64) double axis[3][kLanes];
    for (std::size_t lane = 0; lane < kLanes; ++lane)
        for (int i = 0; i < 3; ++i) axis[i][lane] = second ? record_at(records, node[lane]).v[i] : record_at(records, node[lane]).x[i];
    return {hn::Load(D8(), axis[0]), hn::Load(D8(), axis[1]), hn::Load(D8(), axis[2])};
}
HWY_INLINE Rows subtract(const Rows& a, const Rows& b) { return {hn::Sub(a.x, b.x), hn::Sub(a.y, b.y), hn::Sub(a.z, b.z)}; }
HWY_INLINE Axes turn(const Rows& r) { return {r.x, r.y, r.z}; }
#endif

/// Edges x_k - x_0 of the tets `lane` .. lane + kLanes - 1 as columns; second: of v.
HWY_INLINE M3 load_edges(const TetBatch& batch, std::size_t lane, const NodeRecord* records, bool second) {
    const Rows origin = load_rows(records, batch.node[0] + lane, second);
    M3 edges;
    TROCAR_UNROLL for (int k = 0; k < 3; ++k) {
        const Axes e = turn(subtract(load_rows(records, batch.node[k + 1] + lane, second), origin));
        edges.m[k] = e.x;
        edges.m[3 + k] = e.y;
        edges.m[6 + k] = e.z;
    }
    return edges;
}

HWY_INLINE M3 load_inverse(const TetBatch& batch, std::size_t lane) {
    M3 inverse;
    TROCAR_UNROLL for (int i = 0; i < 9; ++i) inverse.m[i] = hn::Load(D8(), batch.inverse[i] + lane);
    return inverse;
}

HWY_INLINE Sym load_gram(const TetBatch& batch, std::size_t lane) {
    const auto at = [&](int k) HWY_ATTR { return hn::Load(D8(), batch.gram[k] + lane); };
    return {at(0), at(1), at(2), at(3), at(4), at(5)};
}

/// Adds the forces of the tets `lane` .. lane + kLanes - 1 to their slots, tet by tet, corner by corner: several tets of a batch
/// may share one, and this order makes the bits. Columns of h are the forces on corners 1 to 3; corner 0 takes their opposite, so
/// that momentum is kept to rounding.
HWY_INLINE void add_to_slots(const M3& h, const TetBatch& batch, std::size_t lane, PartialForce* partial) {
#if HWY_TARGET == HWY_AVX3 || HWY_TARGET == HWY_AVX2
    Rows rows[4];
    TROCAR_UNROLL for (int k = 0; k < 3; ++k) rows[k + 1] = turn_back({h.m[k], h.m[3 + k], h.m[6 + k]});
    TROCAR_UNROLL for (int i = 0; i < 4; ++i) rows[0].row[i] = hn::Neg(hn::Add(hn::Add(rows[1].row[i], rows[2].row[i]), rows[3].row[i]));
    const auto add = [&](int corner, int tet, hn::Vec<D4> force) HWY_ATTR {
        double* slot = slot_at(partial, batch.slot[corner][lane + static_cast<std::size_t>(tet)]);
        hn::Store(hn::Add(hn::Load(D4(), slot), force), D4(), slot);
    };
#if HWY_TARGET == HWY_AVX3
    TROCAR_UNROLL for (int i = 0; i < 4; ++i) TROCAR_UNROLL for (int corner = 0; corner < 4; ++corner)
        add(corner, i, hn::LowerHalf(D4(), rows[corner].row[i]));
    TROCAR_UNROLL for (int i = 0; i < 4; ++i) TROCAR_UNROLL for (int corner = 0; corner < 4; ++corner)
        add(corner, i + 4, hn::UpperHalf(D4(), rows[corner].row[i]));
#else
    TROCAR_UNROLL for (int i = 0; i < 4; ++i) TROCAR_UNROLL for (int corner = 0; corner < 4; ++corner) add(corner, i, rows[corner].row[i]);
#endif
#else
    alignas(64) double value[9][kLanes];
    for (int i = 0; i < 9; ++i) hn::Store(h.m[i], D8(), value[i]);
    for (std::size_t tet = 0; tet < kLanes; ++tet)
        for (int axis = 0; axis < 3; ++axis) {
            const double f1 = value[3 * axis][tet], f2 = value[3 * axis + 1][tet], f3 = value[3 * axis + 2][tet];
            slot_at(partial, batch.slot[0][lane + tet])[axis] += -((f1 + f2) + f3);
            slot_at(partial, batch.slot[1][lane + tet])[axis] += f1;
            slot_at(partial, batch.slot[2][lane + tet])[axis] += f2;
            slot_at(partial, batch.slot[3][lane + tet])[axis] += f3;
        }
#endif
}

} // namespace trocar::fem::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
