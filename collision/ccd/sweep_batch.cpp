#include "collision/ccd/sweep_batch.hpp"

#include "collision/clones.hpp"
#include "collision/ccd/pair_kinds.hpp"

#include <algorithm>

namespace trocar::collision {
namespace {

TROCAR_LANES_INLINE void write_lane(const LaneSweep& lanes, int lane, Sweep& sweep) noexcept {
    sweep.outcome = lanes.time[lane] > 0.0 ? SweepOutcome::Hit : SweepOutcome::StartsTouching;
    sweep.time = lanes.time[lane];
    sweep.safe_time = lanes.safe_time[lane];
    sweep.gap = lanes.nearest.distance[lane];
    for (std::size_t k = 0; k < 3; ++k) sweep.bary[k] = lanes.nearest.bary[k][lane];
    sweep.normal = lanes.nearest.offset.get(lane) / sweep.gap;
}

template <class Pairs>
TROCAR_LANES_INLINE void sweep_all(const Pairs& kind, std::span<const FeaturePair> pairs, const SweepLimits& limits,
                                   std::span<Sweep> sweeps) noexcept {
    for (std::size_t first = 0; first < pairs.size(); first += kLanes) {
        auto q = kind.gather(pairs.subspan(first));
        measure(q);
        const Mask separated = stays_on_one_side(q, all(limits.distance));
        for (std::size_t k = first; k < std::min(first + kLanes, pairs.size()); ++k) sweeps[k].outcome = SweepOutcome::Separated;
        if (!any(~separated)) continue;
        const LaneSweep lanes = sweep_lanes(q, ~separated, limits);
        for (std::size_t k = first; k < std::min(first + kLanes, pairs.size()); ++k) {
            const int lane = static_cast<int>(k - first);
            if (lanes.unclear[lane]) {
                const auto [a, b] = kind.alone(pairs[k]);
                sweeps[k] = kind.sweep(a, b, limits);
            } else if (lanes.hit[lane])
                write_lane(lanes, lane, sweeps[k]);
        }
    }
}

} // namespace

TROCAR_CLONES
void sweep_vertex_faces(const SurfaceMotion& vertices, const SurfaceMotion& faces, std::span<const FeaturePair> pairs,
                        const SweepLimits& limits, std::span<Sweep> sweeps) noexcept {
    sweep_all(VertexFaces{vertices, faces}, pairs, limits, sweeps);
}

TROCAR_CLONES
void sweep_edge_edges(const SurfaceMotion& a, const SurfaceMotion& b, std::span<const FeaturePair> pairs, const SweepLimits& limits,
                      std::span<Sweep> sweeps) noexcept {
    sweep_all(EdgeEdges{a, b}, pairs, limits, sweeps);
}

} // namespace trocar::collision
