// Volume ratios and elastic energy of a body, vectorised like the forces: the same bits on every instruction set and for any
// number of threads. The densities are laws.hpp's.
#include "fem/tissue/blocks.hpp"
#include "fem/tissue/kernels.hpp"

#include <algorithm>
#include <limits>

#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SSE4)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "fem/tissue/measure_kernels.cpp"
#include <hwy/foreach_target.h> // translates this file once more for every instruction set
#include <hwy/highway.h>

#include "fem/tissue/tet_lanes-inl.hpp"
#include "fem/tissue/tet_laws-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace trocar::fem {
namespace HWY_NAMESPACE {

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

template <MaterialLaw kLaw>
HWY_INLINE V find_energy(const LawConstants& c, const M3& f, V det) {
    if constexpr (kLaw == MaterialLaw::StVK) {
        const Sym g = gram(f);
        const auto strain = [](V entry) HWY_ATTR { return hn::Mul(set(0.5), hn::Sub(entry, set(1.0))); };
        const V xx = strain(g.xx), yy = strain(g.yy), zz = strain(g.zz), trace = hn::Add(hn::Add(xx, yy), zz);
        const V beside = hn::Mul(set(0.5), dot(g.xy, g.xy, g.xz, g.xz, g.yz, g.yz)); // twice the squares of their halves
        return fma(set(c.mu), hn::Add(dot(xx, xx, yy, yy, zz, zz), beside), hn::Mul(set(0.5 * c.lambda), hn::Mul(trace, trace)));
    } else if constexpr (kLaw == MaterialLaw::Corotational) {
        const M3 r = find_rotation(f);
        const V trace = hn::Sub(contract(r, f), set(3.0));
        M3 off;
        TROCAR_UNROLL for (int i = 0; i < 9; ++i) off.m[i] = hn::Sub(f.m[i], r.m[i]);
        return fma(set(c.mu), contract(off, off), hn::Mul(set(0.5 * c.lambda), hn::Mul(trace, trace)));
    } else {
        const V size_sq = contract(f, f);
        const V shear = hn::Sub(hn::Sub(size_sq, set(3.0)), natural_log(hn::Mul(set(0.25), hn::Add(size_sq, set(1.0)))));
        const V volume = hn::Mul(hn::Sub(det, set(1.0)), hn::Sub(hn::Add(det, set(1.0)), set(2.0 * c.rest_volume)));
        return fma(set(0.5 * c.mu), shear, hn::Mul(set(0.5 * c.lambda), volume));
    }
}

/// A lane that is not finite is named in the caller's ids: the lowest.
HWY_INLINE void note_bad(const ForcePlan& plan, std::size_t first, V value, TetSum& sum) {
    alignas(64) double lanes[kLanes];
    hn::Store(value, D8(), lanes);
    for (std::size_t i = 0; i < kLanes; ++i)
        if (!(lanes[i] < std::numeric_limits<double>::infinity())) sum.first_bad_tet = std::min(sum.first_bad_tet, plan.tet_of[first + i]);
}

template <MaterialLaw kLaw>
TetSum sum_chunk(const ForcePlan& plan, const ForceChunk& chunk, const LawConstants& constants, const NodeRecord* records) {
    constexpr std::size_t kGroups = kBatch / kLanes;
    TetSum sum{.low = no_extremes().low};
    LaneExtremes extremes;
    V energy[kGroups];
    for (V& group : energy) group = set(0.0);
    for (std::size_t b = chunk.first_batch; b < chunk.first_batch + chunk.batch_count; ++b)
        for (std::size_t group = 0; group < kGroups; ++group) {
            const TetBatch& batch = plan.batches[b];
            const std::size_t lane = group * kLanes, first = b * kBatch + lane;
            const M3 f = mul(load_edges(batch, lane, records, false), load_inverse(batch, lane));
            const V det = determinant(f, cofactors(f)), volume = hn::Load(D8(), batch.volume + lane);
            const V density = find_energy<kLaw>(constants, f, det), size = hn::Add(hn::Abs(det), hn::Abs(density));
            energy[group] = fma(density, volume, energy[group]);
            const auto inverted = hn::And(hn::Le(det, set(0.0)), hn::Gt(volume, set(0.0))); // fillers have none
            sum.inverted += static_cast<std::uint32_t>(hn::CountTrue(D8(), inverted));
            extremes.note(det, set(0.0), hn::Add(set(static_cast<double>(first)), hn::Iota(D8(), 0.0)));
            if (!hn::AllTrue(D8(), hn::Lt(size, set(std::numeric_limits<double>::infinity())))) note_bad(plan, first, size, sum);
        }
    alignas(64) double lanes[kBatch];
    for (std::size_t group = 0; group < kGroups; ++group) hn::Store(energy[group], D8(), lanes + group * kLanes);
    for (const double lane : lanes) sum.energy += lane;
    const Extremes found = extremes.reduce();
    sum.low = found.low;
    sum.low_place = found.low_place;
    return sum;
}

using ChunkSum = TetSum (*)(const ForcePlan&, const ForceChunk&, const LawConstants&, const NodeRecord*);

ChunkSum pick_sum(MaterialLaw law) {
    switch (law) {
    case MaterialLaw::StVK:
        return &sum_chunk<MaterialLaw::StVK>;
    case MaterialLaw::Corotational:
        return &sum_chunk<MaterialLaw::Corotational>;
    case MaterialLaw::NeoHookean:
        break;
    }
    return &sum_chunk<MaterialLaw::NeoHookean>;
}

} // namespace HWY_NAMESPACE
} // namespace trocar::fem
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace trocar::fem {

namespace {

HWY_EXPORT(pick_sum);

} // namespace

TetSum sum_tets(const ForcePlan& plan, const TetJob& job, std::span<const NodeRecord> records, std::span<TetSum> per_chunk) noexcept {
    const auto run = HWY_DYNAMIC_DISPATCH(pick_sum)(job.law);
    const std::size_t chunks = plan.chunks.size();
    for_each_block(chunks, job.threads, 1, [&](std::size_t, std::size_t begin, std::size_t end) {
        for (std::size_t c = begin; c < end; ++c) per_chunk[c] = run(plan, plan.chunks[c], job.constants, records.data());
    });
    TetSum total{.low = no_extremes().low};
    for (std::size_t c = 0; c < chunks; ++c) {
        const TetSum& part = per_chunk[c];
        total.energy += part.energy;
        total.inverted += part.inverted;
        total.first_bad_tet = std::min(total.first_bad_tet, part.first_bad_tet);
        if (part.low < total.low) {
            total.low = part.low;
            total.low_place = part.low_place;
        }
    }
    return total;
}

} // namespace trocar::fem
#endif
