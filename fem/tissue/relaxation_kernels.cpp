#include "fem/tissue/relaxation.hpp"

#include "fem/tissue/blocks.hpp"
#include "fem/tissue/exponential.hpp"

#include <algorithm>
#include <array>

#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SSE4)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "fem/tissue/relaxation_kernels.cpp"
#include <hwy/foreach_target.h> // translates this file once more for every instruction set
#include <hwy/highway.h>

#include "fem/tissue/tet_lanes-inl.hpp"
#include "fem/tissue/tet_laws-inl.hpp"
#include "fem/tissue/tet_patches-inl.hpp"
#include "fem/tissue/tet_prisms-inl.hpp"

#ifndef TROCAR_FEM_RELAXATION_KERNELS_BRANCHES
#define TROCAR_FEM_RELAXATION_KERNELS_BRANCHES
namespace trocar::fem {

inline constexpr std::size_t kMostBranches = 3;
inline constexpr std::size_t kStrain = 6;               // xx yy zz xy xz yz
inline constexpr std::size_t kPairStrain = kStrain + 6; // and of both prisms xx yy xy of bending

/// What the kernels are told of the material's branches.
struct Branches {
    std::size_t count = 0;
    std::array<double, kMostBranches> g{}, tau{};
    std::array<double, kMostBranches> share{}; // of the way to the strain in one go
    double twice_mu = 0.0, bend = 0.0;         // Pa, of g 1: what strains are multiplied with
};

/// Batches that share one strain, and its numbers. A branch keeps the first number of eight groups, then their second, ...
inline std::size_t group_of(const ForcePlan& plan) noexcept { return plan.patched() ? kPatch : 1; }
inline std::size_t strain_size(const ForcePlan& plan) noexcept { return plan.prisms.empty() ? kStrain : kPairStrain; }
inline std::size_t place_of(const ForcePlan& plan, const Branches& branches, std::size_t first) noexcept {
    return strain_size(plan) * branches.count * kBatch * (first / group_of(plan));
}

} // namespace trocar::fem
#endif

HWY_BEFORE_NAMESPACE();
namespace trocar::fem {
namespace HWY_NAMESPACE {

/// Of tets and patches the last six are not there.
struct Strain {
    V part[kPairStrain];
};

/// dev E
HWY_INLINE void set_deviator(const M3& f, Strain& strain) {
    const Sym g = gram(f);
    const V third = hn::Mul(set(1.0 / 3.0), hn::Add(hn::Add(g.xx, g.yy), g.zz)), half = set(0.5);
    const V parts[kStrain] = {hn::Sub(g.xx, third), hn::Sub(g.yy, third), hn::Sub(g.zz, third), g.xy, g.xz, g.yz};
    TROCAR_UNROLL for (std::size_t i = 0; i < kStrain; ++i) strain.part[i] = hn::Mul(half, parts[i]);
}

HWY_INLINE M3 load_mean(const ForcePlan& plan, std::size_t first, std::size_t lane, const NodeRecord* records) {
    if (!plan.patched()) return mul(load_edges(plan.batches[first], lane, records, false), load_inverse(plan.batches[first], lane));
    PatchGradients g;
    load_patch(plan, first, lane, records, false, g);
    return g.mean;
}

/// What a pair of prisms feels, and how it came to that.
struct FeltPair {
    PairAxes axes;
    PairWeights weights;
    PairFrame<V> frame;
    M3 felt;
    Three<V> bent[2][2]; // each prism's bending along both axes

    HWY_INLINE FeltPair(const ForcePlan& plan, std::size_t first, std::size_t lane, const NodeRecord* records) {
        const PairBatch& pair = plan.pairs[first / kPatch];
        axes = load_axes(pair, lane);
        weights = load_weights(pair, lane, LawConstants{}); // the resistance to what the law does not feel does not relax
        PairGradients g;
        load_pair(plan, first, lane, records, false, g);
        frame = find_frame(g, axes, weights.both);
        felt = HWY_NAMESPACE::felt(g.mean, frame, axes, weights);
        for (int p = 0; p < 2; ++p) bent[p][0] = along_axis(g.bent[p], axes.first), bent[p][1] = along_axis(g.bent[p], axes.second);
    }
    /// And the symmetric part of Fm^T B along the pair's axes.
    HWY_INLINE void set_strain(Strain& strain) const {
        set_deviator(felt, strain);
        for (std::size_t p = 0; p < 2; ++p) {
            V* part = strain.part + kStrain + 3 * p;
            part[0] = inner(frame.first, bent[p][0]);
            part[1] = inner(frame.second, bent[p][1]);
            part[2] = hn::Mul(set(0.5), hn::Add(inner(frame.first, bent[p][1]), inner(frame.second, bent[p][0])));
        }
    }
};

/// sum_k g_k (strain - its own): times moduli the stress.
template <std::size_t kSize>
HWY_INLINE void pull_by_branches(const Branches& branches, const double* relaxed, std::size_t lane, Strain& strain) {
    V pull[kSize];
    for (std::size_t i = 0; i < kSize; ++i) pull[i] = hn::Zero(D8());
    for (std::size_t k = 0; k < branches.count; ++k)
        for (std::size_t i = 0; i < kSize; ++i) {
            const V left = hn::Sub(strain.part[i], hn::LoadU(D8(), relaxed + kBatch * (kSize * k + i) + lane));
            pull[i] = fma(set(branches.g[k]), left, pull[i]);
        }
    for (std::size_t i = 0; i < kSize; ++i) strain.part[i] = hn::Mul(pull[i], set(i < kStrain ? branches.twice_mu : branches.bend));
}

/// f S, of a stress S whose deviator alone E's derivative passes on.
HWY_INLINE M3 first_stress(const M3& f, const Strain& s) {
    const V third = hn::Mul(set(1.0 / 3.0), hn::Add(hn::Add(s.part[0], s.part[1]), s.part[2]));
    return mul(f, Sym{hn::Sub(s.part[0], third), hn::Sub(s.part[1], third), hn::Sub(s.part[2], third), s.part[3], s.part[4], s.part[5]});
}

HWY_INLINE void begin_branches(const ForcePlan& plan, std::size_t first, std::size_t lane, const Branches& branches, const double* relaxed,
                               const NodeRecord* records, PairWork& w) {
    const FeltPair pair(plan, first, lane, records);
    const auto& [axes, weights, frame, felt, bent] = pair;
    Strain s;
    pair.set_strain(s);
    pull_by_branches<kPairStrain>(branches, relaxed, lane, s);
    const M3 stress = first_stress(felt, s);
    set_stress(stress, pull_back(frame, {along_axis(stress, axes.first), along_axis(stress, axes.second), along_axis(stress, axes.across)}, weights), axes, w);
    for (std::size_t p = 0; p < 2; ++p) {
        const V* by = s.part + kStrain + 3 * p; // of C's xx, yy and each of both xy
        w.curved[p] = zero_matrix();
        add_outer(plus(times_each(frame.first, by[0]), times_each(frame.second, by[2])), axes.first, w.curved[p]);
        add_outer(plus(times_each(frame.first, by[2]), times_each(frame.second, by[1])), axes.second, w.curved[p]);
        add_outer(plus(times_each(bent[p][0], by[0]), times_each(bent[p][1], by[2])), axes.first, w.mean);
        add_outer(plus(times_each(bent[p][0], by[2]), times_each(bent[p][1], by[1])), axes.second, w.mean);
    }
}

constexpr std::size_t kGroups = kBatch / kLanes;

/// Forces batch by batch whatever the number of lanes: the order of the sums makes the bits.
void push_chunk(const ForcePlan& plan, const ForceChunk& chunk, const Branches& branches, const double* relaxed, const NodeRecord* records, PartialForce* partial) {
    for (std::size_t first = chunk.first_batch; first < chunk.first_batch + chunk.batch_count; first += group_of(plan)) {
        const double* own = relaxed + place_of(plan, branches, first);
        M3 stress[kGroups];
        for (std::size_t group = 0; group < kGroups; ++group) {
            const M3 f = load_mean(plan, first, group * kLanes, records);
            Strain s;
            set_deviator(f, s);
            pull_by_branches<kStrain>(branches, own, group * kLanes, s);
            stress[group] = first_stress(f, s);
        }
        for (std::size_t b = first; b < first + group_of(plan); ++b)
            for (std::size_t group = 0; group < kGroups; ++group) {
                const TetBatch& batch = plan.batches[b];
                const std::size_t lane = group * kLanes;
                const V factor = hn::Neg(hn::Load(D8(), batch.volume + lane));
                add_to_slots(mult(scaled(stress[group], factor), load_inverse(batch, lane)), batch, lane, partial);
            }
    }
}

void push_pairs(const ForcePlan& plan, const ForceChunk& chunk, const Branches& branches, const double* relaxed, const NodeRecord* records, PartialForce* partial) {
    for (std::size_t first = chunk.first_batch; first < chunk.first_batch + chunk.batch_count; first += kPatch) {
        PairWork work[kGroups];
        for (std::size_t group = 0; group < kGroups; ++group)
            begin_branches(plan, first, group * kLanes, branches, relaxed + place_of(plan, branches, first), records, work[group]);
        for (std::size_t k = 0; k < kPairTets; ++k)
            for (std::size_t group = 0; is_outer(k) && group < kGroups; ++group)
                add_to_slots(edge_force(plan, first, k, group * kLanes, work[group]), plan.batches[first + k], group * kLanes, partial);
    }
}

/// Their own strains go towards the strain.
void follow_chunk(const ForcePlan& plan, const ForceChunk& chunk, const Branches& branches, double* relaxed, const NodeRecord* records) {
    const std::size_t size = strain_size(plan);
    for (std::size_t first = chunk.first_batch; first < chunk.first_batch + chunk.batch_count; first += group_of(plan))
        for (std::size_t lane = 0; lane < kBatch; lane += kLanes) {
            double* own = relaxed + place_of(plan, branches, first) + lane;
            Strain strain;
            if (plan.prisms.empty())
                set_deviator(load_mean(plan, first, lane, records), strain);
            else
                FeltPair(plan, first, lane, records).set_strain(strain);
            for (std::size_t k = 0; k < branches.count; ++k)
                for (std::size_t i = 0; i < size; ++i) {
                    double* at = own + kBatch * (size * k + i);
                    const V kept = hn::LoadU(D8(), at);
                    hn::StoreU(fma(set(branches.share[k]), hn::Sub(strain.part[i], kept), kept), D8(), at);
                }
        }
}

using Push = void (*)(const ForcePlan&, const ForceChunk&, const Branches&, const double*, const NodeRecord*, PartialForce*);
using Follow = void (*)(const ForcePlan&, const ForceChunk&, const Branches&, double*, const NodeRecord*);

Push pick_push(bool pairs) { return pairs ? &push_pairs : &push_chunk; }
Follow pick_follow() { return &follow_chunk; }

} // namespace HWY_NAMESPACE
} // namespace trocar::fem
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace trocar::fem {

namespace {

HWY_EXPORT(pick_push);
HWY_EXPORT(pick_follow);

Branches list_branches(const Material& m) noexcept {
    Branches branches;
    const double g[] = {m.g1, m.g2, m.g3}, tau[] = {m.tau1, m.tau2, m.tau3};
    for (std::size_t k = 0; k < kMostBranches; ++k) {
        if (!(g[k] > 0.0)) continue;
        branches.g[branches.count] = g[k];
        branches.tau[branches.count++] = tau[k];
    }
    const SmallStrain small = find_small_strain(m);
    const double across = small.lambda / (small.lambda + 2.0 * small.mu); // of a plate bent along: how much its thickness gives way
    branches.twice_mu = 2.0 * small.mu;
    branches.bend = 2.0 / 3.0 * small.mu * (1.0 + across * across - (1.0 - across) * (1.0 - across) / 3.0);
    return branches;
}

} // namespace

int count_branches(const Material& material) noexcept { return static_cast<int>(list_branches(material).count); }

std::size_t relaxation_size(const TissueModel& model) noexcept { return place_of(model.plan, list_branches(model.material), model.plan.batches.size()); }

void add_relaxation_forces(const TissueModel& model, std::span<const NodeRecord> records, std::span<const double> relaxed,
                           std::span<PartialForce> partial, unsigned threads) noexcept {
    const Branches branches = list_branches(model.material);
    const ForcePlan& plan = model.plan;
    const auto push = HWY_DYNAMIC_DISPATCH(pick_push)(!plan.prisms.empty());
    for_each_block(plan.chunks.size(), threads, 1, [&](std::size_t, std::size_t begin, std::size_t end) {
        for (std::size_t c = begin; c < end; ++c) push(plan, plan.chunks[c], branches, relaxed.data(), records.data(), partial.data());
    });
}

void relax(const TissueModel& model, std::span<const NodeRecord> records, double h, std::span<double> relaxed, unsigned threads) noexcept {
    Branches branches = list_branches(model.material);
    const ForcePlan& plan = model.plan;
    for (std::size_t k = 0; k < branches.count; ++k) branches.share[k] = branches.tau[k] > 0.0 ? 1.0 - natural_exp(-h / branches.tau[k]) : 0.0;
    const auto follow = HWY_DYNAMIC_DISPATCH(pick_follow)();
    for_each_block(plan.chunks.size(), threads, 1, [&](std::size_t, std::size_t begin, std::size_t end) {
        for (std::size_t c = begin; c < end; ++c) follow(plan, plan.chunks[c], branches, relaxed.data(), records.data());
    });
}

double instant_share(const Material& material) noexcept {
    const Branches branches = list_branches(material);
    double share = 1.0;
    for (std::size_t k = 0; k < branches.count; ++k) share += branches.g[k];
    return share;
}

} // namespace trocar::fem
#endif
