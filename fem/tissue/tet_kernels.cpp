#include "fem/tissue/blocks.hpp"
#include "fem/tissue/kernels.hpp"

#include <algorithm>
#include <array>

#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SSE4) // neither has fused multiply-adds: the baseline does as well
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "fem/tissue/tet_kernels.cpp"
#include <hwy/foreach_target.h> // translates this file once more for every instruction set
#include <hwy/highway.h>

#include "fem/tissue/tet_fibred_laws-inl.hpp"
#include "fem/tissue/tet_lanes-inl.hpp"
#include "fem/tissue/tet_laws-inl.hpp"
#include "fem/tissue/tet_patches-inl.hpp"
#include "fem/tissue/tet_prisms-inl.hpp"

#ifndef TROCAR_FEM_TET_KERNELS_ELEMENTS
#define TROCAR_FEM_TET_KERNELS_ELEMENTS
namespace trocar::fem {

/// What has a gradient of its own.
enum class Elements { Tets, Patches, Pairs };

} // namespace trocar::fem
#endif

HWY_BEFORE_NAMESPACE();
namespace trocar::fem {
namespace HWY_NAMESPACE {

template <class Law, TetKernel kKernel>
HWY_INLINE M3 evaluate(const ForcePlan& plan, std::size_t b, std::size_t lane, const TetJob& job, const M3& edges,
                       const NodeRecord* records, LaneExtremes& extremes) {
    const TetBatch& batch = plan.batches[b];
    const std::size_t first = b * kBatch + lane;
    const V place = hn::Add(set(static_cast<double>(first)), hn::Iota(D8(), 0.0));
    const V factor = hn::Neg(hn::Load(D8(), batch.volume + lane)); // a force is -V P grad_a
    if constexpr (kKernel == TetKernel::Damping) {
        const M3 inverse = load_inverse(batch, lane), f = mul(edges, inverse);
        const M3 rate = mul(load_edges(batch, lane, records, true), inverse);
        return mult(mul(f, viscous_second_stress(hn::Mul(set(job.viscosity), factor), f, rate)), inverse);
    } else if constexpr (kKernel == TetKernel::Stiffness) {
        const M3 inverse = load_inverse(batch, lane), f = mul(edges, inverse), cof = cofactors(f);
        const M3 d = mul(load_edges(batch, lane, records, true), inverse);
        const V det = determinant(f, cof);
        const M3 stress = Law::stress_along(Constants(job.constants, factor, fibres_of(plan, b), lane), f, cof, det, d);
        extremes.note(det, hn::Neg(contract(d, stress)), place);
        return mult(stress, inverse);
    } else {
        constexpr bool kViscous = kKernel == TetKernel::ViscousForce;
        const Response response = Law::template respond<kViscous>(batch, lane, job, factor, edges, records, fibres_of(plan, b));
        extremes.note(response.det, find_growth < kViscous || Law::kTurns > (job.growth, first, response.tangent, response.size_sq), place);
        return response.force;
    }
}

void clear_slots(const ForceChunk& chunk, PartialForce* partial) {
    const auto d4 = hn::CappedTag<double, 4>();
    for (Index slot = chunk.first_slot; slot < chunk.first_slot + chunk.slot_count; ++slot)
        for (std::size_t q = 0; q < 4; q += hn::Lanes(d4)) hn::Store(hn::Zero(d4), d4, partial[slot].f + q);
}

/// Of patches, or of pairs of prisms.
template <class Law, TetKernel kKernel, bool kPairs>
Extremes run_rows(const ForcePlan& plan, const ForceChunk& chunk, const TetJob& job, const NodeRecord* records, PartialForce* partial) {
    clear_slots(chunk, partial);
    LaneExtremes extremes;
    for (std::size_t b = chunk.first_batch; b < chunk.first_batch + chunk.batch_count; b += kPatch) {
        if constexpr (kPairs)
            run_pair_row<Law, kKernel>(plan, b, job, records, partial, extremes);
        else
            run_patch_row<Law, kKernel>(plan, b, job, records, partial, extremes);
    }
    return extremes.reduce();
}

template <class Law, TetKernel kKernel>
Extremes run_chunk(const ForcePlan& plan, const ForceChunk& chunk, const TetJob& job, const NodeRecord* records, PartialForce* partial) {
    clear_slots(chunk, partial);
    LaneExtremes extremes;
    const std::size_t end = chunk.first_batch + chunk.batch_count;
    if constexpr (kKernel == TetKernel::ViscousForce && kLanes == kBatch) {
        // Three batches under way at once: the last one's forces are summed and the next is loaded around the evaluation of this one, a
        // chain longer than the out-of-order window. The sums keep their order. A tenth faster; the elastic chain is too short to gain,
        // and AVX2 has too few registers.
        const TetBatch* last = &plan.batches[chunk.first_batch];
        M3 edges = load_edges(*last, 0, records, false), force;
        TROCAR_UNROLL for (int i = 0; i < 9; ++i) force.m[i] = hn::Zero(D8()); // what the first round sums
        for (std::size_t b = chunk.first_batch; b < end; ++b) {
            add_to_slots(force, *last, 0, partial);
            last = &plan.batches[b];
            force = evaluate<Law, kKernel>(plan, b, 0, job, edges, records, extremes);
            edges = load_edges(plan.batches[std::min(b + 1, end - 1)], 0, records, false);
        }
        add_to_slots(force, *last, 0, partial);
    } else {
        for (std::size_t b = chunk.first_batch; b < end; ++b) {
            const TetBatch& batch = plan.batches[b];
            for (std::size_t lane = 0; lane < kBatch; lane += kLanes) {
                const M3 edges = load_edges(batch, lane, records, false);
                add_to_slots(evaluate<Law, kKernel>(plan, b, lane, job, edges, records, extremes), batch, lane, partial);
            }
        }
    }
    return extremes.reduce();
}

using ChunkRun = Extremes (*)(const ForcePlan&, const ForceChunk&, const TetJob&, const NodeRecord*, PartialForce*);

template <class Law, TetKernel kKernel>
ChunkRun pick_elements(Elements elements) {
    return elements == Elements::Pairs     ? &run_rows<Law, kKernel, true>
           : elements == Elements::Patches ? &run_rows<Law, kKernel, false>
                                           : &run_chunk<Law, kKernel>;
}

template <class Law>
ChunkRun pick_kernel(TetKernel kernel, Elements elements) {
    switch (kernel) {
    case TetKernel::Force:
        return pick_elements<Law, TetKernel::Force>(elements);
    case TetKernel::ViscousForce:
        return pick_elements<Law, TetKernel::ViscousForce>(elements);
    case TetKernel::Stiffness:
        return pick_elements<Law, TetKernel::Stiffness>(elements);
    case TetKernel::Damping:
        break;
    }
    if (elements == Elements::Pairs) return &run_rows<StVKLanes, TetKernel::Damping, true>;
    return &run_chunk<StVKLanes, TetKernel::Damping>; // drag is each tet's own
}

ChunkRun pick_run(TetKernel kernel, MaterialLaw law, Elements elements) {
    switch (law) {
    case MaterialLaw::StVK:
        return pick_kernel<StVKLanes>(kernel, elements);
    case MaterialLaw::Corotational:
        return pick_kernel<CorotationalLanes>(kernel, elements);
    case MaterialLaw::MooneyRivlin:
        return pick_kernel<Alone<MooneyRivlinLanes>>(kernel, elements);
    case MaterialLaw::Ogden:
        return pick_kernel<Alone<OgdenLanes>>(kernel, elements);
    case MaterialLaw::Hgo:
        return pick_kernel<Alone<HgoLanes>>(kernel, elements);
    case MaterialLaw::NeoHookean:
        break;
    }
    return pick_kernel<NeoHookeanLanes>(kernel, elements);
}

int lane_count() { return static_cast<int>(kLanes); }

} // namespace HWY_NAMESPACE
} // namespace trocar::fem
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace trocar::fem {

namespace {

HWY_EXPORT(pick_run);
HWY_EXPORT(lane_count);

bool comes_first(Index place, Index other) noexcept { return other == kNoIndex || place < other; }

} // namespace

Extremes no_extremes() noexcept { return {1e300, 0.0, kNoIndex, kNoIndex}; }

void Extremes::join(const Extremes& other) noexcept {
    if (other.low_place != kNoIndex && (other.low < low || (other.low == low && comes_first(other.low_place, low_place)))) {
        low = other.low;
        low_place = other.low_place;
    }
    if (other.high_place != kNoIndex && (other.high > high || (other.high == high && comes_first(other.high_place, high_place)))) {
        high = other.high;
        high_place = other.high_place;
    }
}

Extremes run_tets(const ForcePlan& plan, const TetJob& job, std::span<const NodeRecord> records, std::span<PartialForce> partial) noexcept {
    const auto run = HWY_DYNAMIC_DISPATCH(pick_run)(job.kernel, job.law, !plan.prisms.empty() ? Elements::Pairs : plan.patched() ? Elements::Patches : Elements::Tets);
    std::array<Extremes, kMostBlocks> found;
    const auto run_range = [&](std::size_t block, std::size_t begin, std::size_t end) {
        Extremes& extremes = found[block] = no_extremes();
        for (std::size_t c = begin; c < end; ++c) extremes.join(run(plan, plan.chunks[c], job, records.data(), partial.data()));
    };
    const std::size_t blocks = for_each_block(plan.chunks.size(), job.threads, 1, run_range);
    for (std::size_t k = 1; k < blocks; ++k) found[0].join(found[k]);
    return found[0];
}

std::string_view chosen_isa() noexcept {
    switch (HWY_DYNAMIC_DISPATCH(lane_count)()) {
    case 8:
        return "avx512";
    case 4:
        return "avx2";
    default:
        return "portable";
    }
}

bool choose_isa(std::string_view isa) noexcept {
    hwy::SetSupportedTargetsForTest(0);
    if (isa.empty()) return true;
    const auto all = hwy::SupportedTargets();
    const auto wanted = isa == "avx512" ? HWY_AVX3 : isa == "avx2" ? HWY_AVX2 : HWY_STATIC_TARGET;
    if ((all & wanted) == 0) return false;
    hwy::SetSupportedTargetsForTest(wanted);
    return chosen_isa() == isa;
}

} // namespace trocar::fem
#endif
