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

/// Gradients of a patch's tets, and their mean.
struct PatchGradients {
    M3 each[kPatch], mean;
};

/// first: batch of the patch's first tets. second: of v instead of x.
HWY_INLINE void load_patch(const ForcePlan& plan, std::size_t first, std::size_t lane, const NodeRecord* records, bool second,
                           PatchGradients& g) {
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
    M3 common; // stress of every tet but patch F_e
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
    w.common = scaled_add(kAlong ? w.along.mean : w.g.mean, set(-job.constants.patch), mean);
    w.growth = set(1.0);
    if constexpr (kAlong) return;
    if constexpr (kSize)
        for (std::size_t k = 0; k < kPatch; ++k) size_sq = hn::Max(size_sq, contract(w.g.each[k], w.g.each[k]));
    w.growth = find_growth<kSize>(job.growth, first * kBatch + lane, tangent, size_sq);
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
    M3 stress = scaled(scaled_add(by, set(job.constants.patch), w.common), factor);
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
    for (std::size_t k = 0; k < kPatch; ++k)
        for (std::size_t group = 0; group < kBatch / kLanes; ++group)
            end_patch<Law, kKernel>(plan, first + k, k, group * kLanes, job, records, work[group], partial, extremes);
}

} // namespace trocar::fem::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
