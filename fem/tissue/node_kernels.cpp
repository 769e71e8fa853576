#include "fem/tissue/blocks.hpp"
#include "fem/tissue/kernels.hpp"

#include <algorithm>
#include <array>

#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SSE4)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "fem/tissue/node_kernels.cpp"
#include <hwy/foreach_target.h> // translates this file once more for every instruction set
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace trocar::fem {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using Quad = hn::CappedTag<double, 4>; // a node's vector, or half of it
using QuadVec = hn::Vec<Quad>;

template <NodeUpdate kUpdate>
Index update_range(const ForcePlan& plan, const NodeJob& job, std::size_t begin, std::size_t end) {
    const Quad d;
    const QuadVec reach = hn::Set(d, job.reach), drift = hn::Set(d, job.drift), limit = hn::Set(d, kAccelerationLimit);
    const QuadVec damping = hn::Set(d, job.mass_damping), two = hn::Set(d, 2.0);
    Index bad = kNoIndex;
    for (std::size_t node = begin; node < end; ++node) {
        const double inv_mass = plan.inv_mass[node];
        const QuadVec factor = hn::Set(d, inv_mass);
        for (std::size_t q = 0; q < 4; q += hn::Lanes(d)) {
            QuadVec force = hn::Load(d, job.partial[plan.slots[plan.slot_begin[node]]].f + q);
            for (Index k = plan.slot_begin[node] + 1; k < plan.slot_begin[node + 1]; ++k)
                force = hn::Add(force, hn::Load(d, job.partial[plan.slots[k]].f + q));
            if (job.extra) force = hn::Add(force, hn::Load(d, job.extra[node].f + q));
            const QuadVec v = hn::Load(d, job.now[node].v + q);
            QuadVec a = hn::Sub(hn::Add(hn::Mul(factor, force), hn::LoadU(d, job.gravity + q)), hn::Mul(damping, v));
            if (inv_mass == 0.0) a = hn::Zero(d);
            if (!hn::AllTrue(d, hn::Lt(hn::Abs(a), limit))) bad = std::min(bad, plan.node_of[node]);
            if constexpr (kUpdate == NodeUpdate::KickDrift) {
                const QuadVec moved = hn::Add(v, hn::Mul(reach, a));
                hn::Store(hn::Add(hn::Load(d, job.now[node].x + q), hn::Mul(drift, moved)), d, job.out[node].x + q);
                hn::Store(moved, d, job.out[node].v + q);
                continue;
            }
            const QuadVec x0 = hn::Load(d, job.start[node].x + q), v0 = hn::Load(d, job.start[node].v + q);
            QuadVec slope_x = v, slope_v = a;
            double* kept = job.slope[node].x + q;
            double* kept_v = job.slope[node].v + q;
            if constexpr (kUpdate == NodeUpdate::MiddleStage) {
                hn::Store(hn::Add(hn::Load(d, kept), hn::Mul(two, v)), d, kept);
                hn::Store(hn::Add(hn::Load(d, kept_v), hn::Mul(two, a)), d, kept_v);
            } else if constexpr (kUpdate == NodeUpdate::FirstStage) {
                hn::Store(v, d, kept);
                hn::Store(a, d, kept_v);
            } else {
                slope_x = hn::Add(hn::Load(d, kept), v);
                slope_v = hn::Add(hn::Load(d, kept_v), a);
            }
            hn::Store(hn::Add(x0, hn::Mul(reach, slope_x)), d, job.out[node].x + q);
            hn::Store(hn::Add(v0, hn::Mul(reach, slope_v)), d, job.out[node].v + q);
        }
    }
    return bad;
}

using RangeUpdate = Index (*)(const ForcePlan&, const NodeJob&, std::size_t, std::size_t);

RangeUpdate pick_update(NodeUpdate update) {
    switch (update) {
    case NodeUpdate::FirstStage:
        return &update_range<NodeUpdate::FirstStage>;
    case NodeUpdate::MiddleStage:
        return &update_range<NodeUpdate::MiddleStage>;
    case NodeUpdate::LastStage:
        return &update_range<NodeUpdate::LastStage>;
    case NodeUpdate::KickDrift:
        break;
    }
    return &update_range<NodeUpdate::KickDrift>;
}

} // namespace HWY_NAMESPACE
} // namespace trocar::fem
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace trocar::fem {

namespace {

HWY_EXPORT(pick_update);

} // namespace

Index update_nodes(const ForcePlan& plan, const NodeJob& job) noexcept {
    const auto update = HWY_DYNAMIC_DISPATCH(pick_update)(job.update);
    std::array<Index, kMostBlocks> bad;
    const std::size_t blocks =
        for_each_block(plan.node_count(), job.threads, kLeastNodes,
                       [&](std::size_t block, std::size_t begin, std::size_t end) { bad[block] = update(plan, job, begin, end); });
    return *std::min_element(bad.begin(), bad.begin() + static_cast<std::ptrdiff_t>(blocks));
}

} // namespace trocar::fem
#endif
