#include "bench/marked_search.hpp"

#include "collision/swept_box.hpp"

#include <algorithm>

namespace trocar::engine {
namespace {

using collision::SurfaceMotion;
using collision::SweptBox;

SweptBox box_of(const SurfaceMotion& motion, std::span<const Index> vertices) noexcept {
    SweptBox box;
    for (const Index v : vertices) box.add(collision::make_swept_box(motion.t0[v], motion.t1[v]));
    return box;
}

bool share_vertex(std::span<const Index> a, std::span<const Index> b) noexcept {
    return std::any_of(a.begin(), a.end(), [&](Index v) { return std::find(b.begin(), b.end(), v) != b.end(); });
}

Index triangle_of(const collision::DopTree& tree, Index cluster) noexcept {
    return tree.block_ids(tree.clusters()[cluster].faces.begin)[0];
}

} // namespace

void MarkedSearch::build(std::span<const collision::SurfaceTopology* const> surfaces, std::span<const std::span<const Vec3>> positions) {
    trees_.resize(surfaces.size());
    for (std::size_t s = 0; s < surfaces.size(); ++s) trees_[s].build(*surfaces[s], positions[s], {.cluster_size = 1});
    marks_.assign(1024, 0);
}

bool MarkedSearch::mark(std::uint64_t key) {
    if (2 * marked_ >= marks_.size()) {
        std::vector<std::uint64_t> old(2 * marks_.size(), 0);
        std::swap(old, marks_);
        marked_ = 0;
        for (const std::uint64_t k : old)
            if (k != 0) static_cast<void>(mark(k - 1));
    }
    const std::size_t mask = marks_.size() - 1;
    std::uint64_t z = (key ^ (key >> 30)) * 0xbf58476d1ce4e5b9ull;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
    std::size_t slot = (z ^ (z >> 31)) & mask;
    for (; marks_[slot] != 0; slot = (slot + 1) & mask)
        if (marks_[slot] == key + 1) return false;
    marks_[slot] = key + 1;
    ++marked_;
    return true;
}

void MarkedSearch::add_vertex_faces(const Side& vertices, const Side& face, bool within, std::vector<collision::FeaturePair>& out) {
    const Triangle& t = face.motion->topology->triangles[face.triangle];
    const SweptBox face_box = box_of(*face.motion, t);
    for (const Index v : vertices.motion->topology->triangles[vertices.triangle]) {
        if (within && share_vertex({&v, 1}, t)) continue;
        if (!collision::are_near(box_of(*vertices.motion, {&v, 1}), face_box, 0.0f)) continue;
        if (mark(std::uint64_t{v} << 32 | face.triangle)) out.push_back({v, face.triangle});
    }
}

/// Edges' marks lie in the upper half of the numbers, and vertices of the second surface in between.
void MarkedSearch::add_triangle_pair(const Side& a, const Side& b, bool within) {
    add_vertex_faces(a, b, within, candidates_.vertex_face);
    if (!within) {
        // one table serves one pair of surfaces: the other way round needs its own numbers
        const Triangle& t = a.motion->topology->triangles[a.triangle];
        const SweptBox face_box = box_of(*a.motion, t);
        for (const Index v : b.motion->topology->triangles[b.triangle])
            if (collision::are_near(box_of(*b.motion, {&v, 1}), face_box, 0.0f) &&
                mark((std::uint64_t{v} | std::uint64_t{1} << 30) << 32 | a.triangle))
                candidates_.face_vertex.push_back({v, a.triangle});
    } else if (a.triangle != b.triangle) {
        add_vertex_faces(b, a, within, candidates_.vertex_face);
    }
    for (const Index e : a.motion->topology->triangle_edges[a.triangle]) {
        if (e == kNoIndex) continue;
        const collision::Edge& edge = a.motion->topology->edges[e];
        const SweptBox box = box_of(*a.motion, edge);
        for (const Index f : b.motion->topology->triangle_edges[b.triangle]) {
            if (f == kNoIndex || (within && share_vertex(edge, b.motion->topology->edges[f]))) continue;
            if (!collision::are_near(box, box_of(*b.motion, b.motion->topology->edges[f]), 0.0f)) continue;
            const Index first = within ? std::min(e, f) : e, second = within ? std::max(e, f) : f;
            if (mark((std::uint64_t{first} | std::uint64_t{1} << 31) << 32 | second)) candidates_.edge_edge.push_back({first, second});
        }
    }
}

void MarkedSearch::step(std::span<const SurfaceMotion> motions, std::vector<collision::SearchContact>& contacts) {
    contacts.clear();
    stats_ = {};
    for (std::size_t s = 0; s < trees_.size(); ++s) trees_[s].refit(motions[s]);
    for (collision::SurfaceIndex a = 0; a < trees_.size(); ++a)
        for (collision::SurfaceIndex b = a; b < trees_.size(); ++b) {
            const collision::SurfacePair pair({Thing::body(a), &trees_[a], motions[a]}, {Thing::body(b), &trees_[b], motions[b]}, {});
            std::fill(marks_.begin(), marks_.end(), 0);
            marked_ = 0;
            candidates_.clear();
            pairs_.clear();
            traversal_.start(pair);
            while (traversal_.advance(pair, 4096, pairs_)) {
            }
            for (const collision::ClusterPair& at : pairs_)
                add_triangle_pair({&motions[a], triangle_of(trees_[a], at.a)}, {&motions[b], triangle_of(trees_[b], at.b)}, a == b);
            stats_.box_tests += traversal_.box_tests();
            stats_.cluster_pairs += pairs_.size();
            stats_.candidates_vf += candidates_.vertex_face.size() + candidates_.face_vertex.size();
            stats_.candidates_ee += candidates_.edge_edge.size();
            pair.decide(candidates_, contacts, stats_);
        }
    std::sort(contacts.begin(), contacts.end(), collision::comes_before);
}

std::size_t MarkedSearch::memory() const noexcept {
    std::size_t sum = marks_.capacity() * sizeof(marks_[0]) + pairs_.capacity() * sizeof(pairs_[0]);
    for (const collision::DopTree& tree : trees_) sum += tree.memory();
    return sum;
}

} // namespace trocar::engine
