// Stress and its derivative of a vector of tets, for every law. Translated once for every instruction set by tet_kernels.cpp.
#if defined(TROCAR_FEM_TET_LAWS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef TROCAR_FEM_TET_LAWS_INL
#undef TROCAR_FEM_TET_LAWS_INL
#else
#define TROCAR_FEM_TET_LAWS_INL
#endif

#include "fem/tissue/kernels.hpp"
#include "fem/tissue/tet_lanes-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace trocar::fem::HWY_NAMESPACE {

/// Smallest and largest value of every lane with the place where it was first met.
struct LaneExtremes {
    V low, high, low_place, high_place;
    HWY_INLINE LaneExtremes() : low(set(1e300)), high(set(0.0)), low_place(set(-1.0)), high_place(set(-1.0)) {}
    HWY_INLINE void note(V small, V large, V place) {
        const auto less = hn::Lt(small, low), more = hn::Gt(large, high);
        low = hn::IfThenElse(less, small, low);
        low_place = hn::IfThenElse(less, place, low_place);
        high = hn::IfThenElse(more, large, high);
        high_place = hn::IfThenElse(more, place, high_place);
    }
    [[nodiscard]] Extremes reduce() const {
        alignas(64) double value[4][kLanes];
        hn::Store(low, D8(), value[0]);
        hn::Store(high, D8(), value[1]);
        hn::Store(low_place, D8(), value[2]);
        hn::Store(high_place, D8(), value[3]);
        Extremes all = no_extremes();
        for (std::size_t i = 0; i < kLanes; ++i)
            all.join({value[0][i], value[1][i], value[2][i] < 0.0 ? kNoIndex : static_cast<Index>(value[2][i]),
                      value[3][i] < 0.0 ? kNoIndex : static_cast<Index>(value[3][i])});
        return all;
    }
};

/// A law's constants times a factor in every lane; rest_volume is a ratio and stays.
struct Constants {
    V mu, lambda, rest_volume, factor;
    const LawConstants* law;  // of laws with more of them, without the factor
    const FibreBatch* fibres; // of the tets' batch; null: a law without
    std::size_t lane;
    HWY_INLINE Constants(const LawConstants& c, V times, const FibreBatch* fibre_batch = nullptr, std::size_t first_lane = 0)
        : mu(hn::Mul(set(c.mu), times)), lambda(hn::Mul(set(c.lambda), times)), rest_volume(set(c.rest_volume)), factor(times), law(&c),
          fibres(fibre_batch), lane(first_lane) {}
};

HWY_INLINE const FibreBatch* fibres_of(const ForcePlan& plan, std::size_t batch) {
    return plan.fibres.empty() ? nullptr : &plan.fibres[batch];
}

/// Results of a force evaluation, per tet.
struct Response {
    M3 force;  // columns: on corners 1 to 3, N
    V det;     // det F
    V tangent; // bound on the tangent's largest eigenvalue, Pa: compared with itself only, to see a tet stiffen
    V size_sq; // |F|^2; left out by laws that neither turn nor drag
};

/// Notes or compares; 1 where there is nothing to compare with. A crushed tet (|F|^2 below 1; 3 is rest) has negligible drag.
template <bool kSize>
HWY_INLINE V find_growth(const TetGrowth& growth, std::size_t first, V tangent, V size_sq) {
    if (growth.use == TetGrowth::Use::None) return set(1.0);
    StiffnessNote& note = growth.notes[first / kBatch];
    double *per_tangent = note.per_tangent + first % kBatch, *per_size = note.per_size + first % kBatch;
    if (growth.use == TetGrowth::Use::Note) {
        hn::Store(hn::Div(set(1.0), tangent), D8(), per_tangent);
        if constexpr (kSize) hn::Store(hn::Div(set(1.0), hn::Max(size_sq, set(1.0))), D8(), per_size);
        return set(1.0);
    }
    const V grown = hn::Mul(tangent, hn::Load(D8(), per_tangent));
    if constexpr (kSize) return hn::Max(grown, hn::Mul(size_sq, hn::Load(D8(), per_size)));
    return grown;
}

/// viscosity (F^T dF + dF^T F), times F the viscous stress: none in rigid motion.
HWY_INLINE Sym viscous_second_stress(V viscosity, const M3& f, const M3& rate) {
    const V twice = hn::Add(viscosity, viscosity);
    const auto diagonal = [&](int i) HWY_ATTR {
        return hn::Mul(twice, dot(f.m[i], rate.m[i], f.m[3 + i], rate.m[3 + i], f.m[6 + i], rate.m[6 + i]));
    };
    const auto beside = [&](int i, int j) HWY_ATTR {
        const V half = dot(f.m[i], rate.m[j], f.m[3 + i], rate.m[3 + j], f.m[6 + i], rate.m[6 + j]);
        return hn::Mul(viscosity, fma(f.m[6 + j], rate.m[6 + i], fma(f.m[3 + j], rate.m[3 + i], fma(f.m[j], rate.m[i], half))));
    };
    return {diagonal(0), diagonal(1), diagonal(2), beside(0, 1), beside(0, 2), beside(1, 2)};
}

/// The viscous second stress of the tets' own velocities.
HWY_INLINE Sym find_drag(const TetBatch& batch, std::size_t lane, const TetJob& job, V factor, const M3& inverse, const M3& f,
                         const NodeRecord* records) {
    return viscous_second_stress(hn::Mul(set(job.viscosity), factor), f, mul(load_edges(batch, lane, records, true), inverse));
}

/// P of linear-in-F laws with a drag S: F (S + shear I) + rest.
HWY_INLINE M3 with_drag(const M3& f, const Sym& drag, V shear, const M3& rest) {
    return mul_add(f, {hn::Add(drag.xx, shear), hn::Add(drag.yy, shear), hn::Add(drag.zz, shear), drag.xy, drag.xz, drag.yz}, rest);
}

/// St. Venant-Kirchhoff, S = lambda tr(E) I + 2 mu E with E = (F^T F - I)/2, P = F S.
struct StVKLanes {
    static HWY_INLINE Sym second_stress(const Constants& c, const M3& f, V& trace) {
        const Sym g = gram(f);
        trace = hn::Add(hn::Add(g.xx, g.yy), g.zz);
        const V pressure = fms(hn::Mul(set(0.5), c.lambda), hn::Sub(trace, set(3.0)), c.mu);
        return {fma(c.mu, g.xx, pressure), fma(c.mu, g.yy, pressure), fma(c.mu, g.zz, pressure),
                hn::Mul(c.mu, g.xy),       hn::Mul(c.mu, g.xz),       hn::Mul(c.mu, g.yz)};
    }
    static constexpr bool kTurns = false;
    template <bool kViscous>
    static HWY_INLINE Response respond(const TetBatch& batch, std::size_t lane, const TetJob& job, V factor, const M3& edges,
                                       const NodeRecord* records, const FibreBatch*) {
        const M3 inverse = load_inverse(batch, lane), f = mul(edges, inverse);
        V trace;
        Sym s = second_stress(Constants(job.constants, factor), f, trace);
        if constexpr (kViscous) {
            const Sym drag = find_drag(batch, lane, job, factor, inverse, f, records);
            s = {hn::Add(s.xx, drag.xx), hn::Add(s.yy, drag.yy), hn::Add(s.zz, drag.zz),
                 hn::Add(s.xy, drag.xy), hn::Add(s.xz, drag.xz), hn::Add(s.yz, drag.yz)};
        }
        // (lambda + 2 mu) |F|^2 of the strains, lambda/2 | |F|^2 - 3 | + mu (|F|^2 + 1) of the stress that turns
        const double mu = job.constants.mu, lambda = job.constants.lambda;
        const V tangent = fma(set(1.5 * lambda + 3.0 * mu), trace, set(1.5 * lambda + mu));
        return {mult(mul(f, s), inverse), determinant(f, cofactors(f)), tangent, trace};
    }
    static HWY_INLINE M3 stress(const Constants& c, const M3& f, const M3&, V, V& tangent) {
        V trace;
        const Sym s = second_stress(c, f, trace);
        tangent = fma(fma(set(1.5), c.lambda, hn::Mul(set(3.0), c.mu)), trace, fma(set(1.5), c.lambda, c.mu));
        return mul(f, s);
    }
    static HWY_INLINE M3 stress_along(const Constants& c, const M3& f, const M3&, V, const M3& d) {
        V trace;
        const Sym s = second_stress(c, f, trace), rate = viscous_second_stress(c.mu, f, d); // mu (F^T d + d^T F)
        const V growth = hn::Mul(c.lambda, contract(f, d));
        return mul_add(
            d, s, mul(f, Sym{hn::Add(rate.xx, growth), hn::Add(rate.yy, growth), hn::Add(rate.zz, growth), rate.xy, rate.xz, rate.yz}));
    }
};

/// Rotation nearest to every matrix; the algorithm of polar.hpp, whose comments explain it.
HWY_INLINE V largest_root(V c2, V c1, V c0, V x) {
    auto active = hn::Gt(x, hn::Neg(set(1.0)));
    for (int round = 0; round < 40; ++round) {
        const V x_sq = hn::Mul(x, x);
        const V value = fma(fma(hn::Add(x_sq, c2), x, c1), x, c0);
        const V slope = fma(fma(set(4.0), x_sq, hn::Add(c2, c2)), x, c1);
        const V next = hn::Sub(x, hn::Div(value, slope));
        active = hn::And(active, hn::And(hn::Gt(slope, hn::Zero(D8())), hn::Lt(next, x)));
        const auto far = hn::Gt(hn::Sub(x, next), hn::Mul(set(1e-15), x));
        x = hn::IfThenElse(active, next, x);
        active = hn::And(active, far);
        if (hn::AllFalse(D8(), active)) break;
    }
    return x;
}

struct Quaternion {
    V w, x, y, z;
};

/// The longest row of the adjugate of a singular symmetric 4x4 matrix: its null vector.
HWY_INLINE Quaternion null_vector(V a00, V a01, V a02, V a03, V a11, V a12, V a13, V a22, V a23, V a33) {
    const auto det2 = [](V p, V q, V r, V s) HWY_ATTR { return fms(p, q, hn::Mul(r, s)); };
    const V s0 = det2(a00, a11, a01, a01), s1 = det2(a00, a12, a01, a02), s2 = det2(a00, a13, a01, a03);
    const V s3 = det2(a01, a12, a11, a02), s4 = det2(a01, a13, a11, a03), s5 = det2(a02, a13, a12, a03);
    const V c5 = det2(a22, a33, a23, a23), c4 = det2(a12, a33, a13, a23), c3 = det2(a12, a23, a13, a22);
    const V c2 = det2(a02, a33, a03, a23), c1 = det2(a02, a23, a03, a22);
    const auto sum = [](V p, V q, V r, V s, V t, V u) HWY_ATTR { return fma(t, u, fnma(r, s, hn::Mul(p, q))); }; // pq - rs + tu
    const V b00 = sum(a11, c5, a12, c4, a13, c3), b01 = hn::Neg(sum(a01, c5, a02, c4, a03, c3));
    const V b02 = sum(a13, s5, a23, s4, a33, s3), b03 = hn::Neg(sum(a12, s5, a22, s4, a23, s3));
    const V b11 = sum(a00, c5, a02, c2, a03, c1), b12 = hn::Neg(sum(a03, s5, a23, s2, a33, s1));
    const V b13 = sum(a02, s5, a22, s2, a23, s1), b22 = sum(a03, s4, a13, s2, a33, s0);
    const V b23 = hn::Neg(sum(a02, s4, a12, s2, a23, s0)), b33 = sum(a02, s3, a12, s1, a22, s0);
    Quaternion q{b00, b01, b02, b03};
    V longest = hn::Abs(b00);
    const auto prefer = [&](V diagonal, V w, V x, V y, V z) HWY_ATTR {
        const auto better = hn::Gt(hn::Abs(diagonal), longest);
        longest = hn::IfThenElse(better, hn::Abs(diagonal), longest);
        q = {hn::IfThenElse(better, w, q.w), hn::IfThenElse(better, x, q.x), hn::IfThenElse(better, y, q.y),
             hn::IfThenElse(better, z, q.z)};
    };
    prefer(b11, b01, b11, b12, b13);
    prefer(b22, b02, b12, b22, b23);
    prefer(b33, b03, b13, b23, b33);
    return q;
}

HWY_INLINE M3 rotation_of(const Quaternion& q) {
    const V ww = hn::Mul(q.w, q.w), xx = hn::Mul(q.x, q.x), yy = hn::Mul(q.y, q.y), zz = hn::Mul(q.z, q.z);
    const auto twice = [](V a, V b, V c, V d) HWY_ATTR {
        const V both = fma(a, b, hn::Mul(c, d));
        return hn::Add(both, both);
    };
    const V x = hn::Neg(q.x), y = hn::Neg(q.y), z = hn::Neg(q.z);
    return {{hn::Sub(hn::Add(ww, xx), hn::Add(yy, zz)), twice(q.x, q.y, q.w, z), twice(q.x, q.z, q.w, q.y), twice(q.x, q.y, q.w, q.z),
             hn::Sub(hn::Add(ww, yy), hn::Add(xx, zz)), twice(q.y, q.z, q.w, x), twice(q.x, q.z, q.w, y), twice(q.y, q.z, q.w, q.x),
             hn::Sub(hn::Add(ww, zz), hn::Add(xx, yy))}};
}

HWY_INLINE M3 find_rotation(const M3& raw) {
    V scale = hn::Abs(raw.m[0]);
    TROCAR_UNROLL for (int i = 1; i < 9; ++i) scale = hn::Max(scale, hn::Abs(raw.m[i]));
    const auto fine = hn::And(hn::Gt(scale, set(1e-150)), hn::Lt(scale, set(1e150)));
    const V per_scale = hn::Div(set(1.0), hn::IfThenElse(fine, scale, set(1.0)));
    M3 f;
    TROCAR_UNROLL for (int i = 0; i < 9; ++i) f.m[i] = hn::IfThenElse(fine, hn::Mul(raw.m[i], per_scale), set(i % 4 == 0 ? 1.0 : 0.0));
    const M3 cof = cofactors(f);
    const V size_sq = contract(f, f), det = determinant(f, cof);
    const V root = largest_root(hn::Mul(set(-2.0), size_sq), hn::Mul(set(-8.0), det),
                                fms(size_sq, size_sq, hn::Mul(set(4.0), contract(cof, cof))), hn::Sqrt(hn::Mul(set(3.0), size_sq)));
    const V* m = f.m;
    const auto diagonal = [&](V a, V b, V c) HWY_ATTR { return hn::Sub(hn::Add(hn::Add(a, b), c), root); };
    Quaternion q =
        null_vector(diagonal(m[0], m[4], m[8]), hn::Sub(m[7], m[5]), hn::Sub(m[2], m[6]), hn::Sub(m[3], m[1]),
                    diagonal(m[0], hn::Neg(m[4]), hn::Neg(m[8])), hn::Add(m[1], m[3]), hn::Add(m[2], m[6]),
                    diagonal(m[4], hn::Neg(m[0]), hn::Neg(m[8])), hn::Add(m[5], m[7]), diagonal(m[8], hn::Neg(m[0]), hn::Neg(m[4])));
    const V length_sq = fma(q.z, q.z, fma(q.y, q.y, fma(q.x, q.x, hn::Mul(q.w, q.w))));
    const auto known = hn::Gt(length_sq, set(1e-60));
    const V per_length = hn::Div(set(1.0), hn::Sqrt(hn::IfThenElse(known, length_sq, set(1.0))));
    q = {hn::IfThenElse(known, hn::Mul(q.w, per_length), set(1.0)), hn::IfThenElseZero(known, hn::Mul(q.x, per_length)),
         hn::IfThenElseZero(known, hn::Mul(q.y, per_length)), hn::IfThenElseZero(known, hn::Mul(q.z, per_length))};
    return rotation_of(q);
}

/// Corotational: linear elasticity in the frame that turns with the tet, P = 2 mu (F - R) + lambda tr(R^T F - I) R.
struct CorotationalLanes {
    static HWY_INLINE V pressure(const Constants& c, const M3& f, const M3& r) {
        return fms(c.lambda, hn::Sub(contract(r, f), set(3.0)), hn::Add(c.mu, c.mu));
    }
    static constexpr bool kTurns = true;
    /// Linear in stretch: it stiffens only where a stretched frame resists to turn, which |F|^2 measures.
    template <bool kViscous>
    static HWY_INLINE Response respond(const TetBatch& batch, std::size_t lane, const TetJob& job, V factor, const M3& edges,
                                       const NodeRecord* records, const FibreBatch*) {
        const Constants c(job.constants, factor);
        const M3 inverse = load_inverse(batch, lane), f = mul(edges, inverse), r = find_rotation(f);
        const M3 turned = scaled(r, pressure(c, f, r));
        const V shear = hn::Add(c.mu, c.mu), tangent = set(2.0 * job.constants.mu + job.constants.lambda);
        const V det = determinant(f, cofactors(f)), size_sq = contract(f, f);
        if constexpr (kViscous)
            return {mult(with_drag(f, find_drag(batch, lane, job, factor, inverse, f, records), shear, turned), inverse), det, tangent,
                    size_sq};
        return {mult(scaled_add(f, shear, turned), inverse), det, tangent, size_sq};
    }
    static HWY_INLINE M3 stress(const Constants& c, const M3& f, const M3&, V, V& tangent) {
        const M3 r = find_rotation(f);
        tangent = fma(set(2.0), c.mu, c.lambda);
        return scaled_add(f, hn::Add(c.mu, c.mu), scaled(r, pressure(c, f, r)));
    }
    static HWY_INLINE M3 stress_along(const Constants& c, const M3& f, const M3&, V, const M3& d) {
        const M3 r = find_rotation(f);
        const V growth = hn::Mul(c.lambda, contract(r, d));
        return scaled_add(d, hn::Add(c.mu, c.mu), scaled_add(r, growth, scaled(rotation_along(f, r, d), pressure(c, f, r))));
    }
    /// dR = R [w]x with (tr(S) I - S) w = axial(R^T d - d^T R), S = R^T F.
    static HWY_INLINE M3 rotation_along(const M3& f, const M3& r, const M3& d) {
        M3 g = tmul(r, f);
        const M3 a = tmul(r, d);
        const V trace = hn::Add(hn::Add(g.m[0], g.m[4]), g.m[8]);
        TROCAR_UNROLL for (int i = 0; i < 9; ++i) g.m[i] = i % 4 == 0 ? hn::Sub(trace, g.m[i]) : hn::Neg(g.m[i]);
        const M3 cof = cofactors(g);
        const V volume = determinant(g, cof), least = set(1e-6); // an exactly mirrored tet turns infinitely fast: cap it
        const V per_volume = hn::Div(set(1.0), hn::IfThenElse(hn::Gt(volume, least), volume, least));
        const V axial[3] = {hn::Sub(a.m[7], a.m[5]), hn::Sub(a.m[2], a.m[6]), hn::Sub(a.m[3], a.m[1])};
        V w[3];
        TROCAR_UNROLL for (int i = 0; i < 3; ++i) w[i] =
            hn::Mul(dot(cof.m[i], axial[0], cof.m[3 + i], axial[1], cof.m[6 + i], axial[2]), per_volume);
        const V zero = hn::Zero(D8());
        return mul(r, M3{{zero, hn::Neg(w[2]), w[1], w[2], zero, hn::Neg(w[0]), hn::Neg(w[1]), w[0], zero}});
    }
};

/// Stable neo-Hookean, P = mu I/(I + 1) F + lambda (J - alpha) cof F, I = |F|^2: smooth through inversion.
struct NeoHookeanLanes {
    static constexpr bool kTurns = false;
    /// On edges instead of F, with G = Dm^-1 Dm^-T: F Dm^-T = Ds G, cof F Dm^-T = cof(Ds) det Dm^-1, |F|^2 = Ds G : Ds; drag
    /// F S Dm^-T = Ds G (Ds^T Vs + Vs^T Ds) G.
    template <bool kViscous>
    static HWY_INLINE Response respond(const TetBatch& batch, std::size_t lane, const TetJob& job, V factor, const M3& edges,
                                       const NodeRecord* records, const FibreBatch*) {
        const LawConstants& c = job.constants;
        const Sym gram = load_gram(batch, lane);
        const V per_rest = hn::Load(D8(), batch.inverse_det + lane);
        const M3 a = mul(edges, gram), cof = cofactors(edges);
        const V det = hn::Mul(determinant(edges, cof), per_rest), size_sq = contract(a, edges), offset = hn::Sub(det, set(c.rest_volume));
        const V mu = hn::Mul(set(c.mu), factor), shear = hn::Sub(mu, hn::Div(mu, hn::Add(size_sq, set(1.0))));
        const V pressure = hn::Mul(hn::Mul(set(c.lambda), factor), hn::Mul(offset, per_rest));
        // 2 mu + lambda (|F| |J - alpha| + |cof F|^2) with |cof F|^2 <= |F|^4 / 3
        const V inner = fma(set(0.5), fma(offset, offset, size_sq), hn::Mul(hn::Mul(size_sq, size_sq), set(1.0 / 3.0)));
        const V tangent = fma(set(c.lambda), inner, set(2.0 * c.mu));
        const M3 force = scaled_add(a, shear, scaled(cof, pressure));
        if constexpr (!kViscous) return {force, det, tangent, size_sq};
        const Sym drag = viscous_second_stress(hn::Mul(set(job.viscosity), factor), edges, load_edges(batch, lane, records, true));
        return {mul_add(mul(a, drag), gram, force), det, tangent, size_sq};
    }
    static HWY_INLINE M3 stress(const Constants& c, const M3& f, const M3& cof, V det, V& tangent) {
        const V size_sq = contract(f, f), offset = hn::Sub(det, c.rest_volume);
        const V shear = hn::Sub(c.mu, hn::Div(c.mu, hn::Add(size_sq, set(1.0))));
        const V inner = fma(set(0.5), fma(offset, offset, size_sq), hn::Mul(hn::Mul(size_sq, size_sq), set(1.0 / 3.0)));
        tangent = fma(c.lambda, inner, hn::Add(c.mu, c.mu));
        return scaled_add(f, shear, scaled(cof, hn::Mul(c.lambda, offset)));
    }
    static HWY_INLINE M3 stress_along(const Constants& c, const M3& f, const M3& cof, V det, const M3& d) {
        const V per_grown = hn::Div(set(1.0), hn::Add(contract(f, f), set(1.0)));
        const V shear = fnma(c.mu, per_grown, c.mu);
        const V along = hn::Mul(hn::Mul(hn::Add(c.mu, c.mu), contract(f, d)), hn::Mul(per_grown, per_grown));
        const V pressure = hn::Mul(c.lambda, hn::Sub(det, c.rest_volume)), growth = hn::Mul(c.lambda, contract(cof, d));
        return scaled_add(d, shear, scaled_add(f, along, scaled_add(cof, growth, scaled(cofactors_along(f, d), pressure))));
    }
};

} // namespace trocar::fem::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
