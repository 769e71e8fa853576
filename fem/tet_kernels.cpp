#include "fem/kernels.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>

#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SSE4) // neither has fused multiply-adds: the baseline does as well
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "fem/tet_kernels.cpp"
#include <hwy/foreach_target.h> // translates this file once more for every instruction set
#include <hwy/highway.h>

#include "fem/tet_lanes-inl.hpp"
#include "fem/tet_laws-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace seldinger::fem {
namespace HWY_NAMESPACE {

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

HWY_INLINE M3 load_inverse(const TetBatch& batch, std::size_t lane) {
    M3 inverse;
    SELDINGER_UNROLL for (int i = 0; i < 9; ++i) inverse.m[i] = hn::Load(D8(), batch.inverse[i] + lane);
    return inverse;
}

/// stress grad_a for the four corners; they sum to zero by construction, so that momentum is kept to rounding.
HWY_INLINE void keep_forces(BatchForces& forces, std::size_t lane, const M3& stress, const M3& inverse) {
    const M3 h = mult(stress, inverse);
    SELDINGER_UNROLL for (int k = 0; k < 3; ++k) keep_corner(forces, k + 1, lane, {h.m[k], h.m[3 + k], h.m[6 + k]});
    const auto opposite = [](V a, V b, V c) HWY_ATTR { return hn::Neg(hn::Add(hn::Add(a, b), c)); };
    keep_corner(forces, 0, lane, {opposite(h.m[0], h.m[1], h.m[2]), opposite(h.m[3], h.m[4], h.m[5]), opposite(h.m[6], h.m[7], h.m[8])});
}

template <class Law, TetKernel kKernel>
HWY_INLINE void evaluate(const TetBatch& batch, std::size_t lane, V place, const TetJob& job, const NodeRecord* records,
                         BatchForces& forces, LaneExtremes& extremes) {
    const M3 inverse = load_inverse(batch, lane);
    const M3 f = mul(load_edges(batch, lane, records, false), inverse);
    const V factor = hn::Neg(hn::Load(D8(), batch.volume + lane)); // a force is -V P grad_a
    if constexpr (kKernel == TetKernel::Damping) {
        const M3 rate = mul(load_edges(batch, lane, records, true), inverse);
        keep_forces(forces, lane, mul(f, viscous_second_stress(hn::Mul(set(job.viscosity), factor), f, rate)), inverse);
        return;
    }
    const Constants constants(job.constants, factor);
    const M3 cof = cofactors(f);
    const V det = determinant(f, cof);
    if constexpr (kKernel == TetKernel::Stiffness) {
        const M3 d = mul(load_edges(batch, lane, records, true), inverse);
        const M3 stress = Law::stress_along(constants, f, cof, det, d);
        keep_forces(forces, lane, stress, inverse);
        extremes.note(det, hn::Neg(contract(d, stress)), place);
    } else {
        constexpr bool kViscous = kKernel == TetKernel::ViscousForce;
        Sym drag{factor, factor, factor, factor, factor, factor};
        if constexpr (kViscous)
            drag = viscous_second_stress(hn::Mul(set(job.viscosity), factor), f, mul(load_edges(batch, lane, records, true), inverse));
        const Response response = Law::template respond<kViscous>(constants, Constants(job.constants, set(1.0)), f, cof, det, drag);
        keep_forces(forces, lane, response.stress, inverse);
        extremes.note(det, hn::Mul(response.tangent, hn::Load(D8(), batch.inverse_sq + lane)), place);
    }
}

template <class Law, TetKernel kKernel>
Extremes run_chunk(const ForcePlan& plan, const ForceChunk& chunk, const TetJob& job, const NodeRecord* records, PartialForce* partial) {
    const auto d4 = hn::CappedTag<double, 4>();
    for (Index slot = chunk.first_slot; slot < chunk.first_slot + chunk.slot_count; ++slot)
        for (std::size_t q = 0; q < 4; q += hn::Lanes(d4)) hn::Store(hn::Zero(d4), d4, partial[slot].f + q);
    LaneExtremes extremes;
    BatchForces forces;
    for (Index b = chunk.first_batch; b < chunk.first_batch + chunk.batch_count; ++b) {
        const TetBatch& batch = plan.batches[b];
        for (std::size_t lane = 0; lane < kBatch; lane += kLanes) {
            const V place = hn::Add(set(static_cast<double>(b * kBatch + lane)), hn::Iota(D8(), 0.0));
            evaluate<Law, kKernel>(batch, lane, place, job, records, forces, extremes);
        }
        add_to_slots(forces, batch, partial);
    }
    return extremes.reduce();
}

using ChunkRun = Extremes (*)(const ForcePlan&, const ForceChunk&, const TetJob&, const NodeRecord*, PartialForce*);

template <class Law> ChunkRun pick_kernel(TetKernel kernel) {
    switch (kernel) {
    case TetKernel::Force: return &run_chunk<Law, TetKernel::Force>;
    case TetKernel::ViscousForce: return &run_chunk<Law, TetKernel::ViscousForce>;
    case TetKernel::Stiffness: return &run_chunk<Law, TetKernel::Stiffness>;
    case TetKernel::Damping: break;
    }
    return &run_chunk<StVKLanes, TetKernel::Damping>;
}

ChunkRun pick_run(TetKernel kernel, MaterialLaw law) {
    switch (law) {
    case MaterialLaw::StVK: return pick_kernel<StVKLanes>(kernel);
    case MaterialLaw::Corotational: return pick_kernel<CorotationalLanes>(kernel);
    case MaterialLaw::NeoHookean: break;
    }
    return pick_kernel<NeoHookeanLanes>(kernel);
}

int lane_count() { return static_cast<int>(kLanes); }

} // namespace HWY_NAMESPACE
} // namespace seldinger::fem
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace seldinger::fem {

namespace {

HWY_EXPORT(pick_run);
HWY_EXPORT(lane_count);

constexpr unsigned kMostBlocks = 64;

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

Extremes run_tets(const ForcePlan& plan, const TetJob& job, std::span<const NodeRecord> records,
                  std::span<PartialForce> partial) noexcept {
    const auto run = HWY_DYNAMIC_DISPATCH(pick_run)(job.kernel, job.law);
    const auto run_range = [&](std::size_t begin, std::size_t end) {
        Extremes extremes = no_extremes();
        for (std::size_t c = begin; c < end; ++c) extremes.join(run(plan, plan.chunks[c], job, records.data(), partial.data()));
        return extremes;
    };
    const std::size_t chunks = plan.chunks.size();
    const std::size_t blocks = std::min<std::size_t>({job.threads, chunks, kMostBlocks});
    if (blocks <= 1) return run_range(0, chunks);
    std::array<Extremes, kMostBlocks> found;
    tbb::parallel_for(std::size_t{0}, blocks, [&](std::size_t k) { found[k] = run_range(k * chunks / blocks, (k + 1) * chunks / blocks); },
                      tbb::simple_partitioner());
    for (std::size_t k = 1; k < blocks; ++k) found[0].join(found[k]);
    return found[0];
}

std::string_view chosen_isa() noexcept {
    switch (HWY_DYNAMIC_DISPATCH(lane_count)()) {
    case 8: return "avx512";
    case 4: return "avx2";
    default: return "portable";
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

} // namespace seldinger::fem
#endif
