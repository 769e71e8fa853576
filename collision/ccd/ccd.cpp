#include "collision/ccd/ccd.hpp"

#include "collision/ccd/ccd_fallback.hpp"
#include "collision/clones.hpp"
#include "collision/ccd/crossing.hpp"
#include "collision/ccd/pair_kinds.hpp"

#include <algorithm>

namespace trocar::collision {
namespace {

TROCAR_LANES_INLINE void write_lane(const LaneCrossing& lanes, int lane, CcdResult& ccd) noexcept {
    ccd.meets = true;
    ccd.decided_by = Decision::Proof;
    ccd.time = lanes.time[lane];
    for (std::size_t k = 0; k < 3; ++k) ccd.bary[k] = lanes.nearest.bary[k][lane];
    ccd.normal = lanes.normal.get(lane);
}

/// Stages 1 and 2 for four pairs, of which the first ccd_results.size() are there.
/// ccd_fallback   the CCD fallback for a single pair
template <int Count, class CcdFallback>
TROCAR_LANES_INLINE void ccd_lanes(LaneDifferences<Count> q, std::span<CcdResult> ccd_results, const CcdFallback& ccd_fallback) {
    measure(q);
    for (CcdResult& ccd : ccd_results) {
        ccd.meets = false;
        ccd.decided_by = Decision::Filter;
    }
    Mask apart = stays_on_one_side(q, all(0.0));
    if (!any(~apart)) return;
    const LaneCrossing crossing = find_crossing(q);
    apart |= crossing.apart;
    if (any(~(apart | crossing.meets))) {
        const LaneSweep sweep = sweep_lanes(q, ~(apart | crossing.meets), {});
        apart |= ~(crossing.meets | sweep.hit | sweep.unclear);
    }
    for (std::size_t k = 0; k < ccd_results.size(); ++k) {
        const int lane = static_cast<int>(k);
        if (crossing.meets[lane])
            write_lane(crossing, lane, ccd_results[k]);
        else if (!apart[lane])
            ccd_results[k] = ccd_fallback(k);
    }
}

template <class Pairs>
TROCAR_LANES_INLINE void meet_all(const Pairs& kind, std::span<const FeaturePair> pairs, std::span<CcdResult> ccd_results) {
    for (std::size_t first = 0; first < pairs.size(); first += kLanes) {
        const auto part = pairs.subspan(first, std::min<std::size_t>(kLanes, pairs.size() - first));
        ccd_lanes(kind.gather(part), ccd_results.subspan(first, part.size()), [&](std::size_t k) {
            const auto [a, b] = kind.alone(part[k]);
            return run_ccd_fallback(a, b);
        });
    }
}

/// One pair in every lane.
template <int Count>
TROCAR_LANES_INLINE LaneDifferences<Count> spread(const Differences<Count>& q) noexcept {
    LaneDifferences<Count> lanes{};
    for (int i = 0; i < Count; ++i) {
        lanes.t0[i] = {all(q.t0[i][0]), all(q.t0[i][1]), all(q.t0[i][2])};
        lanes.t1[i] = {all(q.t1[i][0]), all(q.t1[i][1]), all(q.t1[i][2])};
    }
    return lanes;
}

} // namespace

TROCAR_CLONES
void ccd_vertex_faces(const SurfaceMotion& vertices, const SurfaceMotion& faces, std::span<const FeaturePair> pairs,
                       std::span<CcdResult> ccd_results) {
    meet_all(VertexFaces{vertices, faces}, pairs, ccd_results);
}

TROCAR_CLONES
void ccd_edge_edges(const SurfaceMotion& a, const SurfaceMotion& b, std::span<const FeaturePair> pairs, std::span<CcdResult> ccd_results) {
    meet_all(EdgeEdges{a, b}, pairs, ccd_results);
}

TROCAR_CLONES
CcdResult ccd_vertex_face(const SweptPoint& vertex, const std::array<SweptPoint, 3>& face) {
    CcdResult ccd;
    ccd_lanes(spread(make_differences(vertex, face)), std::span(&ccd, 1), [&](std::size_t) { return run_ccd_fallback(vertex, face); });
    return ccd;
}

TROCAR_CLONES
CcdResult ccd_edge_edge(const std::array<SweptPoint, 2>& a, const std::array<SweptPoint, 2>& b) {
    CcdResult ccd;
    ccd_lanes(spread(make_differences(a, b)), std::span(&ccd, 1), [&](std::size_t) { return run_ccd_fallback(a, b); });
    return ccd;
}

} // namespace trocar::collision
