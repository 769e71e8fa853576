#include "collision/search/candidate_culler.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace trocar::collision {
void CullSnapshot::reserve(std::size_t prism_count, std::size_t pair_count) {
    prisms.reserve(prism_count);
    corners.reserve(prism_count);
    set_of.reserve(prism_count);
    pairs.reserve(pair_count);
    apart.reserve(pair_count);
    left_.reserve(pair_count);
    culler_.reserve(prism_count, pair_count, 2);
}

Result<void> CullSnapshot::look(const CullPlan& plan, CullBackend& backend) {
    apart.assign(pairs.size(), 0);
    left_.assign(pairs.begin(), pairs.end());
    auto looked = culler_.cull({prisms, corners, set_of, 2, reach}, plan, backend, left_);
    if (!looked.ok()) return looked.error();
    report = *looked;
    std::size_t next = 0; // pairs keep their order
    for (std::size_t k = 0; k < pairs.size(); ++k) {
        const bool stayed = next < left_.size() && left_[next] == pairs[k];
        next += stayed;
        apart[k] = !stayed;
    }
    assert(next == left_.size());
    return {};
}

void CandidateCuller::reserve(std::size_t candidates, std::size_t triangles_a, std::size_t triangles_b) {
    keys_.reserve(candidates);
    pair_of_.reserve(candidates);
    place_a_.reserve(triangles_a);
    place_b_.reserve(triangles_b);
}

Index CandidateCuller::prism_of(const SearchSide& side, Index triangle, std::vector<Index>& place, Index set, CullSnapshot& snapshot) {
    if (place[triangle] != kNoIndex) return place[triangle];
    const SurfaceMotion& m = side.motion;
    const Triangle& t = m.topology->triangles[triangle];
    const SweptCorners prism = {m.t0[t[0]], m.t0[t[1]], m.t0[t[2]], m.t1[t[0]], m.t1[t[1]], m.t1[t[2]]};
    if (!std::all_of(prism.begin(), prism.end(), is_bounded)) return kNoIndex;
    place[triangle] = static_cast<Index>(snapshot.prisms.size());
    snapshot.prisms.push_back(prism);
    snapshot.corners.push_back(t);
    if (set == 1) // the two surfaces share no vertices
        for (Index& v : snapshot.corners.back()) v = ~v;
    snapshot.set_of.push_back(set);
    return place[triangle];
}

void CandidateCuller::gather(const SurfacePair& pair, const CandidateLists& candidates, const PairOptions& options,
                             CullSnapshot& snapshot) {
    assert(!pair.within());
    const SurfaceTopology &a = *pair.a().motion.topology, &b = *pair.b().motion.topology;
    keys_.clear();
    for (const FeaturePair& f : candidates.vertex_face) keys_.push_back({a.vertex_owner[f.a], f.b, keys_.size()});
    for (const FeaturePair& f : candidates.face_vertex) keys_.push_back({f.b, b.vertex_owner[f.a], keys_.size()});
    for (const FeaturePair& f : candidates.edge_edge) keys_.push_back({a.edge_owner[f.a], b.edge_owner[f.b], keys_.size()});
    std::sort(keys_.begin(), keys_.end(), [](const Key& x, const Key& y) { return x.a != y.a ? x.a < y.a : x.b < y.b; });

    place_a_.assign(a.triangles.size(), kNoIndex);
    place_b_.assign(b.triangles.size(), kNoIndex);
    snapshot.prisms.clear();
    snapshot.corners.clear();
    snapshot.set_of.clear();
    snapshot.pairs.clear();
    snapshot.apart.clear();
    pair_of_.resize(keys_.size());
    for (std::size_t k = 0; k < keys_.size(); ++k) {
        const Key& key = keys_[k];
        if (k > 0 && key.a == keys_[k - 1].a && key.b == keys_[k - 1].b) {
            pair_of_[key.candidate] = pair_of_[keys_[k - 1].candidate];
            continue;
        }
        const Index first = prism_of(pair.a(), key.a, place_a_, 0, snapshot), second = prism_of(pair.b(), key.b, place_b_, 1, snapshot);
        const bool seen = first != kNoIndex && second != kNoIndex;
        pair_of_[key.candidate] = seen ? static_cast<Index>(snapshot.pairs.size()) : kNoIndex;
        if (seen) snapshot.pairs.push_back({first, second});
    }
    double extent = 0.0;
    for (const SweptCorners& prism : snapshot.prisms)
        for (const Vec3& p : prism) extent = std::max(extent, p.cwiseAbs().maxCoeff());
    snapshot.reach = reach_of_contact(options.distance, options.tolerance, 2.0 * extent);
}

} // namespace trocar::collision
