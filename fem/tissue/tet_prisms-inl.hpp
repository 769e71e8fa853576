// Forces of a vector of pairs of prisms (prisms.hpp): the law is asked once for what both are stretched by.
// Translated once for every instruction set by tet_kernels.cpp and measure_kernels.cpp.
#if defined(TROCAR_FEM_TET_PRISMS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef TROCAR_FEM_TET_PRISMS_INL
#undef TROCAR_FEM_TET_PRISMS_INL
#else
#define TROCAR_FEM_TET_PRISMS_INL
#endif

#include "fem/tissue/prisms.hpp"
#include "fem/tissue/tet_laws-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace trocar::fem::HWY_NAMESPACE {

HWY_INLINE M3 zero_matrix() {
    M3 zero;
    TROCAR_UNROLL for (int i = 0; i < 9; ++i) zero.m[i] = hn::Zero(D8());
    return zero;
}

HWY_INLINE M3 load_matrix(const double (&m)[9][kBatch], std::size_t lane) {
    M3 loaded;
    TROCAR_UNROLL for (int i = 0; i < 9; ++i) loaded.m[i] = hn::Load(D8(), m[i] + lane);
    return loaded;
}

/// What a pair feels, linear in its nodes' positions: mean gradient Fm, the difference of its two prisms' gradients, and how each bends.
struct PairGradients {
    M3 edges[kPairTets]; // of its tetrahedra
    M3 mean, jump, bent[2];
};

/// first: batch of the pairs' first tetrahedra. second: of v instead of x, of the outer tetrahedra alone.
HWY_INLINE void load_pair(const ForcePlan& plan, std::size_t first, std::size_t lane, const NodeRecord* records, bool second, PairGradients& g) {
    g.mean = g.jump = g.bent[0] = g.bent[1] = zero_matrix();
    for (std::size_t k = 0; k < kPairTets; ++k) {
        if (second && !is_outer(k)) continue;
        g.edges[k] = load_edges(plan.batches[first + k], lane, records, second);
        if (!is_outer(k)) continue;
        const PrismBatch& prism = plan.prisms[first + k];
        const M3 part = mul(g.edges[k], load_matrix(prism.mean, lane)), curved = mul(g.edges[k], load_matrix(prism.bend, lane));
        const V side = hn::Load(D8(), prism.side + lane);
        M3& bent = g.bent[k / kPrismTets];
        TROCAR_UNROLL for (int i = 0; i < 9; ++i) {
            g.mean.m[i] = hn::Add(g.mean.m[i], part.m[i]);
            g.jump.m[i] = fma(part.m[i], side, g.jump.m[i]);
            bent.m[i] = hn::Add(bent.m[i], curved.m[i]);
        }
    }
}

/// A number, and how fast it changes along a displacement.
struct Dual {
    V value, rate;
};
HWY_INLINE V plus(V a, V b) { return hn::Add(a, b); }
HWY_INLINE V minus(V a, V b) { return hn::Sub(a, b); }
HWY_INLINE V times(V a, V b) { return hn::Mul(a, b); }
HWY_INLINE Dual plus(const Dual& a, const Dual& b) { return {hn::Add(a.value, b.value), hn::Add(a.rate, b.rate)}; }
HWY_INLINE Dual minus(const Dual& a, const Dual& b) { return {hn::Sub(a.value, b.value), hn::Sub(a.rate, b.rate)}; }
HWY_INLINE Dual times(const Dual& a, const Dual& b) { return {hn::Mul(a.value, b.value), fma(a.value, b.rate, hn::Mul(a.rate, b.value))}; }
HWY_INLINE Dual times(const Dual& a, V b) { return {hn::Mul(a.value, b), hn::Mul(a.rate, b)}; }

/// Of a length squared: 1 / length; of less than kLeastPairArea: 1 / that.
HWY_INLINE V per_length(V square) { return hn::Div(set(1.0), hn::Sqrt(hn::Max(square, set(kLeastPairArea * kLeastPairArea)))); }
HWY_INLINE Dual per_length(const Dual& square) {
    const V value = per_length(square.value);
    const V rate = hn::Mul(hn::Mul(set(-0.5), square.rate), hn::Mul(hn::Mul(value, value), value));
    return {value, hn::IfThenElseZero(hn::Gt(square.value, set(kLeastPairArea * kLeastPairArea)), rate)};
}
/// 1 / a, the root of a
HWY_INLINE V inverse_of(V a) { return hn::Div(set(1.0), a); }
HWY_INLINE Dual inverse_of(const Dual& a) {
    const V value = inverse_of(a.value);
    return {value, hn::Neg(hn::Mul(hn::Mul(value, value), a.rate))};
}
HWY_INLINE V root_of(V a) { return hn::Sqrt(a); }
HWY_INLINE Dual root_of(const Dual& a) {
    const V value = hn::Sqrt(a.value);
    return {value, hn::Div(hn::Mul(set(0.5), a.rate), value)};
}
HWY_INLINE V plus_one(V a) { return hn::Add(a, set(1.0)); }
HWY_INLINE Dual plus_one(const Dual& a) { return {plus_one(a.value), a.rate}; }

/// 1 where the normal has length 1, 0 where it is shorter.
HWY_INLINE V is_unit(V square) { return hn::IfThenElseZero(hn::Gt(square, set(kLeastPairArea * kLeastPairArea)), set(1.0)); }
HWY_INLINE V is_unit(const Dual& square) { return is_unit(square.value); }

/// Three numbers of each pair.
template <class S>
struct Three {
    S x, y, z;
};
template <class S>
HWY_INLINE S inner(const Three<S>& a, const Three<S>& b) {
    return plus(plus(times(a.x, b.x), times(a.y, b.y)), times(a.z, b.z));
}
template <class S>
HWY_INLINE Three<S> cross(const Three<S>& a, const Three<S>& b) {
    return {minus(times(a.y, b.z), times(a.z, b.y)), minus(times(a.z, b.x), times(a.x, b.z)), minus(times(a.x, b.y), times(a.y, b.x))};
}
template <class S, class T>
HWY_INLINE Three<S> times_each(const Three<S>& a, const T& s) {
    return {times(a.x, s), times(a.y, s), times(a.z, s)};
}
template <class S>
HWY_INLINE Three<S> plus(const Three<S>& a, const Three<S>& b) {
    return {plus(a.x, b.x), plus(a.y, b.y), plus(a.z, b.z)};
}
template <class S>
HWY_INLINE Three<S> minus(const Three<S>& a, const Three<S>& b) {
    return {minus(a.x, b.x), minus(a.y, b.y), minus(a.z, b.z)};
}

/// Rest axes of pairs: two along the wall, one across.
struct PairAxes {
    Three<V> first, second, across;
};
HWY_INLINE PairAxes load_axes(const PairBatch& pair, std::size_t lane) {
    const auto at = [&](int i) HWY_ATTR { return hn::Load(D8(), pair.along[i] + lane); };
    PairAxes axes{{at(0), at(1), at(2)}, {at(3), at(4), at(5)}, {}};
    axes.across = cross(axes.first, axes.second);
    return axes;
}

/// a v; with rates, those of b v
HWY_INLINE Three<V> along_axis(const M3& a, const Three<V>& v) {
    const auto row = [&](int i) HWY_ATTR { return dot(a.m[i], v.x, a.m[i + 1], v.y, a.m[i + 2], v.z); };
    return {row(0), row(3), row(6)};
}
HWY_INLINE Three<Dual> along_axis(const M3& a, const M3& b, const Three<V>& v) {
    const Three<V> value = along_axis(a, v), rate = along_axis(b, v);
    return {{value.x, rate.x}, {value.y, rate.y}, {value.z, rate.z}};
}
/// to += u v^T; of what moves, the rates
HWY_INLINE void add_outer(const Three<V>& u, const Three<V>& v, M3& to) {
    const V of[3] = {u.x, u.y, u.z}, by[3] = {v.x, v.y, v.z};
    TROCAR_UNROLL for (int i = 0; i < 9; ++i) to.m[i] = fma(of[i / 3], by[i % 3], to.m[i]);
}
HWY_INLINE void add_outer(const Three<Dual>& u, const Three<V>& v, M3& to) { add_outer(Three<V>{u.x.rate, u.y.rate, u.z.rate}, v, to); }

/// The pair's three edges as they stand, its normal N, and how far the third leans out of it.
template <class S>
struct PairFrame {
    Three<S> first, second, up; // Fm times the rest axes
    Three<S> normal;            // N
    S per_area, high;           // 1 / |first x second|, N . up
    Three<S> lean;              // up - N high
    Three<S> kink[2];           // jump times the rest axes along the wall
    S step[2];                  // N . kink
    V unit;                     // is_unit
    Three<S> fold;              // along the pair, with first . fold = step[0] and second . fold = step[1]
    S root, growth;             // of 1 + both |fold|^2; what of `both fold step^T` makes Fm's metric grow by both step step^T
};

template <class S>
HWY_INLINE Three<S> mix_edges(const PairFrame<S>& f) {
    return minus(times_each(f.second, f.step[0]), times_each(f.first, f.step[1]));
}

/// both: product of the prisms' shares of the pair
template <class S>
HWY_INLINE void complete(PairFrame<S>& f, V both) {
    const Three<S> area = cross(f.first, f.second);
    const S square = inner(area, area);
    f.unit = is_unit(square);
    f.per_area = per_length(square);
    f.normal = times_each(area, f.per_area);
    f.high = inner(f.normal, f.up);
    f.lean = minus(f.up, times_each(f.normal, f.high));
    for (int i = 0; i < 2; ++i) f.step[i] = inner(f.normal, f.kink[i]);
    f.fold = times_each(cross(mix_edges(f), f.normal), f.per_area);
    f.root = root_of(plus_one(times(inner(f.fold, f.fold), both)));
    f.growth = inverse_of(plus_one(f.root));
}

HWY_INLINE PairFrame<V> find_frame(const PairGradients& g, const PairAxes& axes, V both) {
    PairFrame<V> f;
    f.first = along_axis(g.mean, axes.first), f.second = along_axis(g.mean, axes.second), f.up = along_axis(g.mean, axes.across);
    f.kink[0] = along_axis(g.jump, axes.first), f.kink[1] = along_axis(g.jump, axes.second);
    complete(f, both);
    return f;
}
HWY_INLINE PairFrame<Dual> find_frame(const PairGradients& g, const PairGradients& along, const PairAxes& axes, V both) {
    PairFrame<Dual> f;
    f.first = along_axis(g.mean, along.mean, axes.first), f.second = along_axis(g.mean, along.mean, axes.second), f.up = along_axis(g.mean, along.mean, axes.across);
    f.kink[0] = along_axis(g.jump, along.jump, axes.first), f.kink[1] = along_axis(g.jump, along.jump, axes.second);
    complete(f, both);
    return f;
}

/// How a pair resists besides by the law.
struct PairWeights {
    V less;       // of the leaning, what the law does not see
    V hold, kink; // Pa: of what the prisms differ by along the wall, across it
    V both;       // product of the prisms' shares of the pair
};
HWY_INLINE PairWeights load_weights(const PairBatch& pair, std::size_t lane, const LawConstants& constants) {
    const V hold = hn::Load(D8(), pair.hold + lane), kink = hn::Load(D8(), pair.kink + lane);
    return {hn::Sub(set(1.0), hn::Load(D8(), pair.shear + lane)), hn::Mul(set(constants.patch), hold), hn::Mul(set(constants.patch), kink),
            hn::Mul(set(kPatchShare / kHoldShare), hold)};
}

/// The gradient that the law is asked for: Fm with less of the leaning, and stretched as its prisms are where they are folded. Of what moves, its rate, from Fm's.
template <class S>
HWY_INLINE M3 felt(const M3& mean, const PairFrame<S>& f, const PairAxes& axes, const PairWeights& w) {
    M3 felt = mean;
    add_outer(times_each(f.lean, hn::Neg(w.less)), axes.across, felt);
    const Three<S> stretch = times_each(f.fold, times(f.growth, w.both));
    add_outer(times_each(stretch, f.step[0]), axes.first, felt);
    add_outer(times_each(stretch, f.step[1]), axes.second, felt);
    return felt;
}

/// As the pair stands.
HWY_INLINE PairFrame<V> values_of(const PairFrame<Dual>& f) {
    const auto three = [](const Three<Dual>& a) HWY_ATTR { return Three<V>{a.x.value, a.y.value, a.z.value}; };
    return {three(f.first), three(f.second), three(f.up), three(f.normal), f.per_area.value, f.high.value, three(f.lean), {three(f.kink[0]), three(f.kink[1])},
            {f.step[0].value, f.step[1].value}, f.unit, three(f.fold), f.root.value, f.growth.value};
}

/// Energy by kinks, J/m^3.
HWY_INLINE V kink_energy(const PairFrame<V>& f, const PairWeights& w) {
    const V all = hn::Add(inner(f.kink[0], f.kink[0]), inner(f.kink[1], f.kink[1]));
    const V across = fma(f.step[0], f.step[0], hn::Mul(f.step[1], f.step[1]));
    return hn::Mul(set(0.5), fma(w.hold, all, hn::Mul(hn::Sub(w.kink, w.hold), across)));
}

/// What the pair's energy changes by with Fm and with its jump, the law's own stress aside.
template <class S>
struct PairStress {
    Three<S> first, second, up, kink[2]; // of Fm's and the jump's columns along the rest axes
};

/// The law's stress times the rest axes.
template <class S>
struct PairPulls {
    Three<S> first, second, across;
};

/// Derivatives by what the frame was made of, the last first.
template <class S>
HWY_INLINE PairStress<S> pull_back(const PairFrame<S>& f, const PairPulls<S>& pull, const PairWeights& w) {
    PairStress<S> s;
    // less of the leaning
    const S across = inner(f.normal, pull.across);
    s.up = times_each(minus(pull.across, times_each(f.normal, across)), hn::Neg(w.less));
    Three<S> by_normal = times_each(plus(times_each(pull.across, f.high), times_each(f.up, across)), w.less);
    // the stretch of what is folded
    const S part = times(f.growth, w.both);
    const Three<S> by_stretch = plus(times_each(pull.first, f.step[0]), times_each(pull.second, f.step[1]));
    const S bend = times(times(times(f.growth, f.growth), inverse_of(f.root)), inner(f.fold, by_stretch)); // growth falls by half of this with both |fold|^2
    const Three<S> by_fold = minus(times_each(by_stretch, part), times_each(f.fold, times(times(bend, w.both), w.both)));
    const Three<S> mix = mix_edges(f), by_mix = times_each(cross(f.normal, by_fold), f.per_area);
    by_normal = plus(by_normal, times_each(cross(by_fold, mix), f.per_area));
    const S by_step[2] = {plus(times(part, inner(f.fold, pull.first)), inner(f.second, by_mix)), minus(times(part, inner(f.fold, pull.second)), inner(f.first, by_mix))};
    // the resistance to kinks
    const V more = hn::Sub(w.kink, w.hold);
    for (int i = 0; i < 2; ++i) {
        const S step = plus(by_step[i], times(f.step[i], more));
        s.kink[i] = plus(times_each(f.kink[i], w.hold), times_each(f.normal, step));
        by_normal = plus(by_normal, times_each(f.kink[i], step));
    }
    // the normal, and the area
    const S along = times(plus(inner(f.normal, by_normal), inner(f.fold, by_fold)), f.unit);
    const Three<S> by_area = times_each(minus(by_normal, times_each(f.normal, along)), f.per_area);
    s.first = minus(cross(f.second, by_area), times_each(by_mix, f.step[1]));
    s.second = plus(cross(by_area, f.first), times_each(by_mix, f.step[0]));
    return s;
}

/// kLanes pairs between their two rounds over tetrahedra. Of products with a displacement the rates of all.
struct PairWork {
    PairGradients g, along; // along: of displacements or velocities
    M3 mean, jump, curved[2]; // what the energy changes by with Fm, with the jump, and with each prism's bending
    V growth;
};

/// From the law's stress, or its rate, to what changes with Fm and with the jump.
template <class S>
HWY_INLINE void set_stress(const M3& law, const PairStress<S>& s, const PairAxes& axes, PairWork& w) {
    w.mean = law;
    add_outer(s.first, axes.first, w.mean);
    add_outer(s.second, axes.second, w.mean);
    add_outer(s.up, axes.across, w.mean);
    w.jump = zero_matrix();
    add_outer(s.kink[0], axes.first, w.jump);
    add_outer(s.kink[1], axes.second, w.jump);
}

/// Viscosity of what the law does not see: of bending, with twice the viscosity in place of E'; of what the prisms differ by, in the shares that resist it
/// elastically. By the rates of Fm^T B and Fm^T J, which no rotation changes.
HWY_INLINE void add_shape_drag(const TetJob& job, const PairAxes& axes, const PairWeights& weights, const PairFrame<V>& now, const PairFrame<Dual>& moving, PairWork& w) {
    const V per_bend = set(2.0 / 3.0 * job.viscosity);
    for (int p = 0; p < 2; ++p) {
        const M3 turned = tmul(w.along.mean, w.g.bent[p]), own = tmul(w.g.mean, w.along.bent[p]);
        M3 rate;
        TROCAR_UNROLL for (int i = 0; i < 9; ++i) rate.m[i] = hn::Mul(per_bend, hn::Add(turned.m[i], own.m[i]));
        const M3 on_bent = mul(w.g.mean, rate), on_mean = mult(w.g.bent[p], rate);
        TROCAR_UNROLL for (int i = 0; i < 9; ++i) {
            w.curved[p].m[i] = hn::Add(w.curved[p].m[i], on_bent.m[i]);
            w.mean.m[i] = hn::Add(w.mean.m[i], on_mean.m[i]);
        }
    }
    const V per_modulus = set(job.viscosity * kPatchShare / job.constants.patch); // over mu
    const Three<Dual>* moves[3] = {&moving.first, &moving.second, &moving.up};
    const Three<V>*edge[3] = {&now.first, &now.second, &now.up}, *rest[3] = {&axes.first, &axes.second, &axes.across};
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 2; ++j) {
            const V pull = hn::Mul(hn::Mul(i < 2 ? weights.hold : weights.kink, per_modulus), inner(*moves[i], moving.kink[j]).rate);
            add_outer(times_each(*edge[i], pull), *rest[j], w.jump);
            add_outer(times_each(now.kink[j], pull), *rest[i], w.mean);
        }
}

template <class Law, TetKernel kKernel>
HWY_INLINE void begin_force(const TetJob& job, const Constants& c, const PairAxes& axes, const PairWeights& weights, PairWork& w, V& tangent, V& size_sq) {
    constexpr bool kElastic = kKernel != TetKernel::Damping, kDrag = kKernel != TetKernel::Force;
    PairFrame<V> now;
    [[maybe_unused]] PairFrame<Dual> moving;
    if constexpr (kDrag) {
        moving = find_frame(w.g, w.along, axes, weights.both);
        now = values_of(moving);
    } else {
        now = find_frame(w.g, axes, weights.both);
    }
    const M3 f = felt(w.g.mean, now, axes, weights);
    size_sq = contract(f, f);
    M3 stress = zero_matrix();
    PairWeights own = weights;
    if constexpr (kElastic) {
        const M3 cof = cofactors(f);
        stress = Law::stress(c, f, cof, determinant(f, cof), tangent);
    } else {
        own.hold = own.kink = set(0.0);
    }
    for (int p = 0; p < 2; ++p) w.curved[p] = scaled(w.g.bent[p], set(kElastic ? job.constants.bend : 0.0));
    if constexpr (kDrag) stress = mul_add(f, viscous_second_stress(set(job.viscosity), f, felt(w.along.mean, moving, axes, weights)), stress);
    set_stress(stress, pull_back(now, {along_axis(stress, axes.first), along_axis(stress, axes.second), along_axis(stress, axes.across)}, own), axes, w);
    if constexpr (kDrag) add_shape_drag(job, axes, weights, now, moving, w);
}

template <class Law>
HWY_INLINE void begin_product(const TetJob& job, const Constants& c, const PairAxes& axes, const PairWeights& weights, PairWork& w) {
    const PairFrame<Dual> moving = find_frame(w.g, w.along, axes, weights.both);
    const M3 f = felt(w.g.mean, values_of(moving), axes, weights), cof = cofactors(f);
    const V det = determinant(f, cof);
    V unused = set(0.0);
    const M3 stress = Law::stress(c, f, cof, det, unused), rate = Law::stress_along(c, f, cof, det, felt(w.along.mean, moving, axes, weights));
    set_stress(rate, pull_back(moving, {along_axis(stress, rate, axes.first), along_axis(stress, rate, axes.second), along_axis(stress, rate, axes.across)}, weights), axes, w);
    for (int p = 0; p < 2; ++p) w.curved[p] = scaled(w.along.bent[p], set(job.constants.bend));
}

template <class Law, TetKernel kKernel>
HWY_INLINE void begin_pair(const ForcePlan& plan, std::size_t first, std::size_t lane, const TetJob& job, const NodeRecord* records, PairWork& w) {
    constexpr bool kSize = kKernel == TetKernel::ViscousForce || Law::kTurns;
    const PairBatch& pair = plan.pairs[first / kPatch];
    const PairAxes axes = load_axes(pair, lane);
    const PairWeights weights = load_weights(pair, lane, job.constants);
    const Constants c(job.constants, set(1.0), fibres_of(plan, first), lane);
    load_pair(plan, first, lane, records, false, w.g);
    if constexpr (kKernel != TetKernel::Force) load_pair(plan, first, lane, records, true, w.along);
    w.growth = set(1.0);
    if constexpr (kKernel == TetKernel::Stiffness) {
        begin_product<Law>(job, c, axes, weights, w);
    } else {
        V tangent = set(0.0), size_sq = set(0.0);
        begin_force<Law, kKernel>(job, c, axes, weights, w, tangent, size_sq);
        if constexpr (kKernel != TetKernel::Damping) w.growth = find_growth<kSize>(job.growth, first * kBatch + lane, tangent, size_sq);
    }
}

/// det F of a tetrahedron with these edges.
HWY_INLINE V volume_ratio(const M3& edges, const TetBatch& batch, std::size_t lane) {
    return hn::Mul(determinant(edges, cofactors(edges)), hn::Load(D8(), batch.inverse_det + lane));
}

/// A force is -V d energy / d edges. Of the pairs' k-th tetrahedra, outer ones.
HWY_INLINE M3 edge_force(const ForcePlan& plan, std::size_t first, std::size_t k, std::size_t lane, const PairWork& w) {
    const PrismBatch& prism = plan.prisms[first + k];
    const M3 felt = scaled_add(w.jump, hn::Load(D8(), prism.side + lane), w.mean);
    const M3 force = mult(felt, load_matrix(prism.mean, lane)), back = mult(w.curved[k / kPrismTets], load_matrix(prism.bend, lane));
    const V factor = hn::Neg(hn::Load(D8(), plan.pairs[first / kPatch].volume + lane));
    M3 sum;
    TROCAR_UNROLL for (int i = 0; i < 9; ++i) sum.m[i] = hn::Mul(hn::Add(force.m[i], back.m[i]), factor);
    return sum;
}

/// Forces of the pairs' k-th tetrahedra.
template <class Law, TetKernel kKernel>
HWY_INLINE void end_pair(const ForcePlan& plan, std::size_t first, std::size_t k, std::size_t lane, const PairWork& w, PartialForce* partial, LaneExtremes& extremes) {
    const std::size_t b = first + k;
    const TetBatch& batch = plan.batches[b];
    const M3 force = is_outer(k) ? edge_force(plan, first, k, lane, w) : zero_matrix();
    if constexpr (kKernel != TetKernel::Damping) {
        const V place = hn::Add(set(static_cast<double>(b * kBatch + lane)), hn::Iota(D8(), 0.0));
        V large = w.growth;
        if constexpr (kKernel == TetKernel::Stiffness) large = is_outer(k) ? hn::Neg(contract(w.along.edges[k], force)) : set(0.0);
        extremes.note(volume_ratio(w.g.edges[k], batch, lane), large, place);
    }
    if (is_outer(k)) add_to_slots(force, batch, lane, partial);
}

/// Forces of a row of pairs, batch by batch whatever the number of lanes: the order of the sums makes the bits.
template <class Law, TetKernel kKernel>
HWY_INLINE void run_pair_row(const ForcePlan& plan, std::size_t first, const TetJob& job, const NodeRecord* records, PartialForce* partial, LaneExtremes& extremes) {
    PairWork work[kBatch / kLanes];
    for (std::size_t group = 0; group < kBatch / kLanes; ++group) begin_pair<Law, kKernel>(plan, first, group * kLanes, job, records, work[group]);
    for (std::size_t k = 0; k < kPairTets; ++k)
        for (std::size_t group = 0; group < kBatch / kLanes; ++group)
            end_pair<Law, kKernel>(plan, first, k, group * kLanes, work[group], partial, extremes);
}

} // namespace trocar::fem::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
