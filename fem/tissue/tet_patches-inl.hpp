// Stress and its derivative of a vector of patches (patches.hpp): the law is asked once for the mean of up to kPatch tets.
// Translated once for every instruction set by tet_kernels.cpp.
#if defined(TROCAR_FEM_TET_PATCHES_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef TROCAR_FEM_TET_PATCHES_INL
#undef TROCAR_FEM_TET_PATCHES_INL
#else
#define TROCAR_FEM_TET_PATCHES_INL
#endif

#include "fem/tissue/tet_laws-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace trocar::fem::HWY_NAMESPACE {

/// Gradients of a patch's tets, and their mean. Of a pair of prisms too: the difference of its two, and how each of them bends.
struct PatchGradients {
    M3 each[kPatch], mean;
    M3 jump, bent[2];
};

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

constexpr std::size_t kPrismTets = 3;

/// Places of a patch that may have a tet.
HWY_INLINE std::size_t filled(const ForcePlan& plan) { return plan.prisms.empty() ? kPatch : 2 * kPrismTets; }

HWY_INLINE void load_prisms(const ForcePlan& plan, std::size_t first, std::size_t lane, const NodeRecord* records, bool second, PatchGradients& g) {
    g.mean = g.jump = g.bent[0] = g.bent[1] = zero_matrix();
    for (std::size_t k = 0; k < 2 * kPrismTets; ++k) {
        const TetBatch& batch = plan.batches[first + k];
        g.each[k] = mul(load_edges(batch, lane, records, second), load_inverse(batch, lane));
        const PrismBatch& prism = plan.prisms[first + k];
        const M3 part = mul(g.each[k], load_matrix(prism.mean, lane));
        M3& bent = g.bent[k / kPrismTets];
        TROCAR_UNROLL for (int i = 0; i < 9; ++i) g.mean.m[i] = hn::Add(g.mean.m[i], part.m[i]);
        g.jump = scaled_add(part, hn::Load(D8(), prism.side + lane), g.jump);
        const M3 curved = mul(g.each[k], load_matrix(prism.bend, lane));
        TROCAR_UNROLL for (int i = 0; i < 9; ++i) bent.m[i] = hn::Add(bent.m[i], curved.m[i]);
    }
}

/// first: batch of the patch's first tets. second: of v instead of x.
HWY_INLINE void load_patch(const ForcePlan& plan, std::size_t first, std::size_t lane, const NodeRecord* records, bool second,
                           PatchGradients& g) {
    if (!plan.prisms.empty()) return load_prisms(plan, first, lane, records, second, g);
    TROCAR_UNROLL for (int i = 0; i < 9; ++i) g.mean.m[i] = hn::Zero(D8());
    for (std::size_t k = 0; k < kPatch; ++k) {
        const TetBatch& batch = plan.batches[first + k];
        g.each[k] = mul(load_edges(batch, lane, records, second), load_inverse(batch, lane));
        g.mean = scaled_add(g.each[k], hn::Load(D8(), plan.shares[first + k].share + lane), g.mean);
    }
}

/// What every tet of a patch is given besides patch (F_e - Fm): nothing of it but this depends on the law.
template <class Law, TetKernel kKernel>
HWY_INLINE M3 mean_stress(const TetJob& job, const FibreBatch* fibres, std::size_t lane, const PatchGradients& g,
                          const PatchGradients& along, V& tangent) {
    const Constants c(job.constants, set(1.0), fibres, lane);
    const M3 cof = cofactors(g.mean);
    const V det = determinant(g.mean, cof);
    if constexpr (kKernel == TetKernel::Stiffness)
        return Law::stress_along(c, g.mean, cof, det, along.mean);
    else
        return Law::stress(c, g.mean, cof, det, tangent);
}

/// kLanes patches between their two rounds over tets.
struct PatchWork {
    PatchGradients g, along;
    M3 common; // stress of every tet but patch F_e; of prisms, of the mean
    V growth;
};

template <class Law, TetKernel kKernel>
HWY_INLINE void begin_patch(const ForcePlan& plan, std::size_t first, std::size_t lane, const TetJob& job, const NodeRecord* records,
                            PatchWork& w) {
    constexpr bool kAlong = kKernel == TetKernel::Stiffness, kSize = kKernel == TetKernel::ViscousForce || Law::kTurns;
    load_patch(plan, first, lane, records, false, w.g);
    if constexpr (kAlong) load_patch(plan, first, lane, records, true, w.along);
    V tangent = set(0.0), size_sq = set(0.0);
    const M3 mean = mean_stress<Law, kKernel>(job, fibres_of(plan, first), lane, w.g, w.along, tangent);
    w.common = plan.prisms.empty() ? scaled_add(kAlong ? w.along.mean : w.g.mean, set(-job.constants.patch), mean) : mean;
    w.growth = set(1.0);
    if constexpr (kAlong) return;
    if constexpr (kSize)
        for (std::size_t k = 0; k < filled(plan); ++k) size_sq = hn::Max(size_sq, contract(w.g.each[k], w.g.each[k]));
    w.growth = find_growth<kSize>(job.growth, first * kBatch + lane, tangent, size_sq);
}

/// What the patches' energy, of their whole volume, changes by with the gradients of their k-th tets.
HWY_INLINE M3 prism_stress(const PrismBatch& prism, std::size_t k, std::size_t lane, const LawConstants& constants, const M3& common, const PatchGradients& g) {
    const V hold = hn::Mul(hn::Mul(set(constants.patch), hn::Load(D8(), prism.hold + lane)), hn::Load(D8(), prism.side + lane));
    const M3 stress = mult(scaled_add(g.jump, hold, common), load_matrix(prism.mean, lane));
    return scaled_add(mult(g.bent[k / kPrismTets], load_matrix(prism.bend, lane)), set(constants.bend), stress);
}

/// Forces of the patches' k-th tets.
template <class Law, TetKernel kKernel>
HWY_INLINE void end_patch(const ForcePlan& plan, std::size_t b, std::size_t k, std::size_t lane, const TetJob& job,
                          const NodeRecord* records, const PatchWork& w, PartialForce* partial, LaneExtremes& extremes) {
    constexpr bool kAlong = kKernel == TetKernel::Stiffness;
    const TetBatch& batch = plan.batches[b];
    const V place = hn::Add(set(static_cast<double>(b * kBatch + lane)), hn::Iota(D8(), 0.0));
    const V factor = hn::Neg(hn::Load(D8(), batch.volume + lane)); // a force is -V P grad_a
    const M3 inverse = load_inverse(batch, lane);
    const M3& f = w.g.each[k];
    const M3& by = kAlong ? w.along.each[k] : f;
    const V det = determinant(f, cofactors(f));
    M3 stress;
    if (plan.prisms.empty())
        stress = scaled(scaled_add(by, set(job.constants.patch), w.common), factor);
    else
        stress = scaled(prism_stress(plan.prisms[b], k, lane, job.constants, w.common, kAlong ? w.along : w.g), hn::Neg(hn::Load(D8(), plan.prisms[b].volume + lane)));
    if constexpr (kAlong)
        extremes.note(det, hn::Neg(contract(w.along.each[k], stress)), place);
    else
        extremes.note(det, w.growth, place);
    if constexpr (kKernel == TetKernel::ViscousForce) stress = mul_add(f, find_drag(batch, lane, job, factor, inverse, f, records), stress);
    add_to_slots(mult(stress, inverse), batch, lane, partial);
}

/// Forces of a row of patches, batch by batch whatever the number of lanes: the order of the sums makes the bits.
template <class Law, TetKernel kKernel>
HWY_INLINE void run_patch_row(const ForcePlan& plan, std::size_t first, const TetJob& job, const NodeRecord* records, PartialForce* partial,
                              LaneExtremes& extremes) {
    PatchWork work[kBatch / kLanes];
    for (std::size_t group = 0; group < kBatch / kLanes; ++group)
        begin_patch<Law, kKernel>(plan, first, group * kLanes, job, records, work[group]);
    for (std::size_t k = 0; k < filled(plan); ++k)
        for (std::size_t group = 0; group < kBatch / kLanes; ++group)
            end_patch<Law, kKernel>(plan, first + k, k, group * kLanes, job, records, work[group], partial, extremes);
}

} // namespace trocar::fem::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
