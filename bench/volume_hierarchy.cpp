#include "bench/volume_hierarchy.hpp"

#include <algorithm>
#include <numeric>

namespace trocar::engine {

using collision::SurfaceMotion;
using collision::SurfaceTopology;
using collision::TrianglePair;

VolumeHierarchy::VolumeHierarchy(VolumeKind kind, const SurfaceTopology& surface, std::span<const Vec3> positions)
    : kind_(kind), surface_(&surface) {
    if (surface.triangles.empty()) return;
    std::vector<Vec3> centres;
    for (const Triangle& t : surface.triangles) centres.push_back((positions[t[0]] + positions[t[1]] + positions[t[2]]) / 3.0);
    std::vector<Index> ids(centres.size());
    std::iota(ids.begin(), ids.end(), Index{0});
    nodes_.reserve(2 * ids.size());
    nodes_.emplace_back();
    split(centres, ids, 0);
}

void VolumeHierarchy::split(std::span<const Vec3> centres, std::span<Index> ids, Index node) {
    if (ids.size() == 1) {
        nodes_[node].triangle = ids[0];
        return;
    }
    Vec3 low = centres[ids[0]], high = low;
    for (const Index id : ids) {
        low = low.cwiseMin(centres[id]);
        high = high.cwiseMax(centres[id]);
    }
    int axis = 0;
    (high - low).maxCoeff(&axis);
    const std::size_t middle = ids.size() / 2;
    std::nth_element(ids.begin(), ids.begin() + static_cast<std::ptrdiff_t>(middle), ids.end(),
                     [&](Index a, Index b) { return centres[a][axis] < centres[b][axis]; });
    const auto left = static_cast<Index>(nodes_.size());
    nodes_[node].left = left;
    nodes_.emplace_back();
    nodes_.emplace_back();
    split(centres, ids.first(middle), left);
    split(centres, ids.subspan(middle), left + 1);
}

VolumeHierarchy::Volume VolumeHierarchy::around(const SurfaceMotion& m, const Triangle& t, double distance) const {
    Vec3 low = m.t0[t[0]], high = low;
    for (const Index v : t)
        for (const Vec3& p : {m.t0[v], m.t1[v]}) {
            low = low.cwiseMin(p);
            high = high.cwiseMax(p);
        }
    if (kind_ == VolumeKind::Box) return {low - Vec3::Constant(0.5 * distance), high + Vec3::Constant(0.5 * distance)};
    const Vec3 centre = 0.5 * (low + high);
    double radius_sq = 0.0;
    for (const Index v : t)
        for (const Vec3& p : {m.t0[v], m.t1[v]}) radius_sq = std::max(radius_sq, (p - centre).squaredNorm());
    return {centre, Vec3(std::sqrt(radius_sq) + 0.5 * distance, 0.0, 0.0)};
}

VolumeHierarchy::Volume VolumeHierarchy::join(const Volume& a, const Volume& b) const {
    if (kind_ == VolumeKind::Box) return {a.low.cwiseMin(b.low), a.high.cwiseMax(b.high)};
    const Vec3 between = b.low - a.low;
    const double apart = between.norm(), ra = a.high.x(), rb = b.high.x();
    if (apart + rb <= ra) return a;
    if (apart + ra <= rb) return b;
    const double radius = 0.5 * (apart + ra + rb);
    return {a.low + between * ((radius - ra) / apart), Vec3(radius, 0.0, 0.0)};
}

bool VolumeHierarchy::overlap(const Volume& a, const Volume& b) const {
    if (kind_ == VolumeKind::Box) return (a.low.array() <= b.high.array()).all() && (b.low.array() <= a.high.array()).all();
    const double reach = a.high.x() + b.high.x();
    return (a.low - b.low).squaredNorm() <= reach * reach;
}

double VolumeHierarchy::size(const Volume& v) const { return kind_ == VolumeKind::Box ? (v.high - v.low).squaredNorm() : v.high.x(); }

void VolumeHierarchy::refit(const SurfaceMotion& motion, double distance) {
    for (std::size_t n = nodes_.size(); n-- > 0;) { // children come after their parent
        Node& node = nodes_[n];
        node.volume = node.left == kNoIndex ? around(motion, surface_->triangles[node.triangle], distance)
                                            : join(nodes_[node.left].volume, nodes_[node.left + 1].volume);
    }
}

void VolumeHierarchy::find_pairs(std::vector<TrianglePair>& pairs) { find_pairs(*this, pairs); }

void VolumeHierarchy::find_pairs(VolumeHierarchy& other, std::vector<TrianglePair>& pairs) {
    const bool self = this == &other;
    pairs.clear();
    stack_.clear();
    if (!nodes_.empty() && !other.nodes_.empty()) stack_.emplace_back(0, 0);
    while (!stack_.empty()) {
        const auto [a, b] = stack_.back();
        stack_.pop_back();
        const Node &na = nodes_[a], &nb = other.nodes_[b];
        if (self && a == b) {
            if (na.left == kNoIndex) continue;
            stack_.insert(stack_.end(), {{na.left, na.left}, {na.left + 1, na.left + 1}, {na.left, na.left + 1}});
            continue;
        }
        if (!overlap(na.volume, nb.volume)) continue;
        if (na.left == kNoIndex && nb.left == kNoIndex)
            pairs.push_back({na.triangle, nb.triangle});
        else if (nb.left == kNoIndex || (na.left != kNoIndex && size(na.volume) >= size(nb.volume)))
            stack_.insert(stack_.end(), {{na.left, b}, {na.left + 1, b}});
        else
            stack_.insert(stack_.end(), {{a, nb.left}, {a, nb.left + 1}});
    }
}

void list_features(const SurfaceTopology& a, const SurfaceTopology& b, std::span<const TrianglePair> pairs, PairFeatures& out) {
    const bool self = &a == &b;
    const auto holds = [self](const Triangle& t, Index v) { return self && (t[0] == v || t[1] == v || t[2] == v); };
    out.vertex_face.clear();
    out.face_vertex.clear();
    out.edge_edge.clear();
    for (const TrianglePair& pair : pairs) {
        const Triangle &ta = a.triangles[pair.a], &tb = b.triangles[pair.b];
        for (const Index v : ta)
            if (!holds(tb, v)) out.vertex_face.push_back({v, pair.b});
        for (const Index v : tb)
            if (!holds(ta, v)) out.face_vertex.push_back({v, pair.a});
        for (const Index ea : a.triangle_edges[pair.a])
            for (const Index eb : b.triangle_edges[pair.b]) {
                if (ea == kNoIndex || eb == kNoIndex) continue;
                const collision::Edge &x = a.edges[ea], &y = b.edges[eb];
                if (!self || (x[0] != y[0] && x[0] != y[1] && x[1] != y[0] && x[1] != y[1])) out.edge_edge.push_back({ea, eb});
            }
    }
}

} // namespace trocar::engine
