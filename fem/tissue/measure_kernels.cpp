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

#include "fem/tissue/tet_fibred_laws-inl.hpp"
#include "fem/tissue/tet_lanes-inl.hpp"
#include "fem/tissue/tet_laws-inl.hpp"
#include "fem/tissue/tet_patches-inl.hpp"
#include "fem/tissue/tet_prisms-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace trocar::fem {
namespace HWY_NAMESPACE {

template <MaterialLaw kLaw>
HWY_INLINE V find_energy(const LawConstants& c, const FibreBatch* fibres, std::size_t lane, const M3& f, V det) {
    if constexpr (kLaw == MaterialLaw::MooneyRivlin) {
        return MooneyRivlinLanes::energy(c, fibres, lane, f, det);
    } else if constexpr (kLaw == MaterialLaw::Ogden) {
        return OgdenLanes::energy(c, fibres, lane, f, det);
    } else if constexpr (kLaw == MaterialLaw::Hgo) {
        return HgoLanes::energy(c, fibres, lane, f, det);
    } else if constexpr (kLaw == MaterialLaw::StVK) {
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

/// Sums over a chunk's tets, the groups of a batch apart.
class ChunkTotal {
public:
    void add(const ForcePlan& plan, std::size_t b, std::size_t group, V det, V density) {
        const std::size_t lane = group * kLanes, first = b * kBatch + lane;
        const V volume = hn::Load(D8(), plan.batches[b].volume + lane), size = hn::Add(hn::Abs(det), hn::Abs(density));
        energy_[group] = fma(density, volume, energy_[group]);
        const auto inverted = hn::And(hn::Le(det, set(0.0)), hn::Gt(volume, set(0.0))); // fillers have none
        sum_.inverted += static_cast<std::uint32_t>(hn::CountTrue(D8(), inverted));
        extremes_.note(det, set(0.0), hn::Add(set(static_cast<double>(first)), hn::Iota(D8(), 0.0)));
        if (!hn::AllTrue(D8(), hn::Lt(size, set(std::numeric_limits<double>::infinity())))) note_bad(plan, first, size, sum_);
    }
    [[nodiscard]] TetSum finish() {
        alignas(64) double lanes[kBatch];
        for (std::size_t group = 0; group < kGroups; ++group) hn::Store(energy_[group], D8(), lanes + group * kLanes);
        for (const double lane : lanes) sum_.energy += lane;
        const Extremes found = extremes_.reduce();
        sum_.low = found.low;
        sum_.low_place = found.low_place;
        return sum_;
    }
    static constexpr std::size_t kGroups = kBatch / kLanes;
    ChunkTotal() {
        for (V& group : energy_) group = set(0.0);
    }

private:
    TetSum sum_{.low = no_extremes().low};
    LaneExtremes extremes_;
    V energy_[kGroups];
};

template <MaterialLaw kLaw>
TetSum sum_chunk(const ForcePlan& plan, const ForceChunk& chunk, const LawConstants& constants, const NodeRecord* records) {
    ChunkTotal total;
    for (std::size_t b = chunk.first_batch; b < chunk.first_batch + chunk.batch_count; ++b)
        for (std::size_t group = 0; group < ChunkTotal::kGroups; ++group) {
            const TetBatch& batch = plan.batches[b];
            const std::size_t lane = group * kLanes;
            const M3 f = mul(load_edges(batch, lane, records, false), load_inverse(batch, lane));
            const V det = determinant(f, cofactors(f));
            total.add(plan, b, group, det, find_energy<kLaw>(constants, fibres_of(plan, b), lane, f, det));
        }
    return total.finish();
}

template <MaterialLaw kLaw>
TetSum sum_patches(const ForcePlan& plan, const ForceChunk& chunk, const LawConstants& constants, const NodeRecord* records) {
    ChunkTotal total;
    for (std::size_t b = chunk.first_batch; b < chunk.first_batch + chunk.batch_count; b += kPatch)
        for (std::size_t group = 0; group < ChunkTotal::kGroups; ++group) {
            PatchGradients g;
            load_patch(plan, b, group * kLanes, records, false, g);
            const V mean = find_energy<kLaw>(constants, fibres_of(plan, b), group * kLanes, g.mean, determinant(g.mean, cofactors(g.mean)));
            for (std::size_t k = 0; k < kPatch; ++k) {
                const M3 off = scaled_add(g.mean, set(-1.0), g.each[k]);
                const V det = determinant(g.each[k], cofactors(g.each[k]));
                total.add(plan, b + k, group, det, fma(set(0.5 * constants.patch), contract(off, off), mean));
            }
        }
    return total.finish();
}

template <MaterialLaw kLaw>
TetSum sum_pairs(const ForcePlan& plan, const ForceChunk& chunk, const LawConstants& constants, const NodeRecord* records) {
    ChunkTotal total;
    for (std::size_t b = chunk.first_batch; b < chunk.first_batch + chunk.batch_count; b += kPatch)
        for (std::size_t group = 0; group < ChunkTotal::kGroups; ++group) {
            const std::size_t lane = group * kLanes;
            const PairBatch& pair = plan.pairs[b / kPatch];
            const PairAxes axes = load_axes(pair, lane);
            const PairWeights weights = load_weights(pair, lane, constants);
            PairGradients g;
            load_pair(plan, b, lane, records, false, g);
            const PairFrame<V> frame = find_frame(g, axes, weights.both);
            const M3 f = felt(g.mean, frame, axes, weights);
            const V stretched = find_energy<kLaw>(constants, fibres_of(plan, b), lane, f, determinant(f, cofactors(f)));
            const V bent = hn::Mul(set(0.5 * constants.bend), hn::Add(contract(g.bent[0], g.bent[0]), contract(g.bent[1], g.bent[1])));
            const V energy = hn::Add(hn::Add(stretched, bent), kink_energy(frame, weights));
            for (std::size_t k = 0; k < kPairTets; ++k) total.add(plan, b + k, group, volume_ratio(g.edges[k], plan.batches[b + k], lane), energy);
        }
    return total.finish();
}

using ChunkSum = TetSum (*)(const ForcePlan&, const ForceChunk&, const LawConstants&, const NodeRecord*);

template <MaterialLaw kLaw>
ChunkSum pick_elements(bool patched, bool prisms) {
    return prisms ? &sum_pairs<kLaw> : patched ? &sum_patches<kLaw> : &sum_chunk<kLaw>;
}

ChunkSum pick_sum(MaterialLaw law, bool patched, bool prisms) {
    switch (law) {
    case MaterialLaw::StVK:
        return pick_elements<MaterialLaw::StVK>(patched, prisms);
    case MaterialLaw::Corotational:
        return pick_elements<MaterialLaw::Corotational>(patched, prisms);
    case MaterialLaw::MooneyRivlin:
        return pick_elements<MaterialLaw::MooneyRivlin>(patched, prisms);
    case MaterialLaw::Ogden:
        return pick_elements<MaterialLaw::Ogden>(patched, prisms);
    case MaterialLaw::Hgo:
        return pick_elements<MaterialLaw::Hgo>(patched, prisms);
    case MaterialLaw::NeoHookean:
        break;
    }
    return pick_elements<MaterialLaw::NeoHookean>(patched, prisms);
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
    const auto run = HWY_DYNAMIC_DISPATCH(pick_sum)(job.law, plan.patched(), !plan.prisms.empty());
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
