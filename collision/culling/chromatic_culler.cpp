#include "collision/culling/chromatic_culler.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>

namespace trocar::collision {
namespace {

/// Pairs of adjacent triangles, per triangle, up to which orphans are listed once and for all; an ordinary mesh has about ten.
constexpr std::size_t kMostAdjacent = 64;

bool holds(const Triangle& t, Index vertex) noexcept { return t[0] == vertex || t[1] == vertex || t[2] == vertex; }
bool share_vertex(const Edge& a, const Edge& b) noexcept { return a[0] == b[0] || a[0] == b[1] || a[1] == b[0] || a[1] == b[1]; }
/// A degenerate triangle names a corner or an edge twice.
template <class Id>
bool is_repeated(const std::array<Id, 3>& ids, int k) noexcept {
    return (k > 0 && ids[k] == ids[0]) || (k > 1 && ids[k] == ids[1]);
}

SweptCorners corners_of(const SurfaceMotion& m, const Triangle& t) noexcept {
    return {m.t0[t[0]], m.t0[t[1]], m.t0[t[2]], m.t1[t[0]], m.t1[t[1]], m.t1[t[2]]};
}

} // namespace

ChromaticCuller::Side::Side(const SurfaceTopology& surface) : topology(&surface), stars(surface.triangles, surface.vertex_count()) {
    edge_begin.assign(surface.edges.size() + 1, 0);
    const auto for_each_use = [&](auto&& visit) {
        for (Index t = 0; t < surface.triangles.size(); ++t) {
            const auto& edges = surface.triangle_edges[t];
            for (int k = 0; k < 3; ++k)
                if (edges[k] != kNoIndex && !is_repeated(edges, k)) visit(edges[k], t);
        }
    };
    for_each_use([&](Index edge, Index) { ++edge_begin[edge + 1]; });
    std::partial_sum(edge_begin.begin(), edge_begin.end(), edge_begin.begin());
    edge_triangles.resize(edge_begin.back());
    std::vector<Index> next(edge_begin.begin(), edge_begin.end() - 1);
    for_each_use([&](Index edge, Index t) { edge_triangles[next[edge]++] = t; });
}

SweptBox ChromaticCuller::Side::face_box(Index face) const noexcept {
    const Triangle& t = topology->triangles[face];
    SweptBox box = boxes[t[0]];
    box.add(boxes[t[1]]);
    box.add(boxes[t[2]]);
    return box;
}

SweptBox ChromaticCuller::Side::edge_box(Index edge) const noexcept {
    SweptBox box = boxes[topology->edges[edge][0]];
    box.add(boxes[topology->edges[edge][1]]);
    return box;
}

void ChromaticCuller::Side::move(const SurfaceMotion& step) {
    motion = step;
    boxes.resize(step.t0.size());
    for (std::size_t v = 0; v < boxes.size(); ++v) boxes[v] = make_swept_box(step.t0[v], step.t1[v]);
}

ChromaticCuller::ChromaticCuller(const SurfaceTopology& surface) : sets_(make_chromatic_sets(surface.triangles, surface.vertex_count())) {
    sides_.emplace_back(surface);
    gather_orphans();
}

ChromaticCuller::ChromaticCuller(const SurfaceTopology& a, const SurfaceTopology& b) : orphans_listed_(true) {
    sides_.emplace_back(a);
    sides_.emplace_back(b);
}

void ChromaticCuller::find_near(const SurfaceMotion& a, BoxTree& tree_a, const SurfaceMotion& b, BoxTree& tree_b, double distance,
                                double tolerance) {
    counts_ = {};
    pairs_.clear();
    adjacent_.clear();
    distance_ = distance;
    sides_.front().move(a);
    if (!self()) sides_.back().move(b);
    double extent = 0.0;
    for (const Side& side : sides_) {
        Box3 box;
        for (const auto positions : {side.motion.t0, side.motion.t1})
            for (const Vec3& p : positions)
                if (is_bounded(p)) box.add(p);
        extent = std::max(extent, box.longest_edge());
    }
    reach_ = reach_of_contact(distance, tolerance, extent);
    if (self()) {
        near_.find_self(tree_a, round_up(distance), pairs_, orphans_listed_ ? nullptr : &adjacent_);
    } else {
        near_.find(tree_a, tree_b, round_up(distance), pairs_);
    }
    counts_.box_tests = near_.box_tests();
    counts_.near_pairs = counts_.left_pairs = pairs_.size();
    counts_.near_triangles = counts_.left_triangles = count_triangles();
}

std::size_t ChromaticCuller::count_triangles() const {
    const std::size_t count_a = sides_.front().topology->triangles.size();
    std::vector<std::uint8_t> seen(count_a + (self() ? 0 : side_b().topology->triangles.size()), 0);
    for (const auto& [a, b] : pairs_) seen[a] = seen[self() ? b : count_a + b] = 1;
    return static_cast<std::size_t>(std::count(seen.begin(), seen.end(), 1));
}

/// cull(problem, pairs of its prisms): takes out what it proves apart.
template <class Cull>
Result<void> ChromaticCuller::cull_pairs(Cull&& cull) {
    const Side &a = sides_.front(), &b = side_b();
    const Index count_a = static_cast<Index>(a.topology->triangles.size()), shift = self() ? 0 : count_a;
    const Index vertex_shift = self() ? 0 : static_cast<Index>(a.topology->vertex_count());
    std::vector<SweptCorners> prisms;
    std::vector<Triangle> corners;
    std::vector<Index> set_of = sets_.set_of;
    for (const Side& side : sides_)
        for (const Triangle& t : side.topology->triangles) {
            prisms.push_back(corners_of(side.motion, t));
            const Index s = &side == &b ? vertex_shift : 0;
            corners.push_back({t[0] + s, t[1] + s, t[2] + s});
            if (!self()) set_of.push_back(&side == &b ? 1 : 0);
        }
    const auto visible = [&](Index prism) { return std::all_of(prisms[prism].begin(), prisms[prism].end(), is_bounded); };
    std::vector<TrianglePair> asked, kept;
    for (const auto& [ta, tb] : pairs_) (visible(ta) && visible(tb + shift) ? asked : kept).push_back({ta, tb + shift});
    const CullProblem problem{prisms, corners, set_of, set_count(), reach_};
    auto done = cull(problem, asked);
    pairs_.clear();
    for (const auto* list : {&asked, &kept})
        for (const auto& [ta, tb] : *list) pairs_.push_back({ta, tb - shift});
    counts_.left_pairs = pairs_.size();
    counts_.left_triangles = count_triangles();
    return done;
}

Result<void> ChromaticCuller::look(const CullPlan& plan, CullBackend& backend) {
    return cull_pairs([&](const CullProblem& problem, std::vector<TrianglePair>& pairs) -> Result<void> {
        auto report = culler_.cull(problem, plan, backend, pairs);
        if (!report.ok()) return report.error();
        counts_.pictures = *report;
        return {};
    });
}

Result<void> ChromaticCuller::look(const QueryPlan& plan, VisibilityCanvas& canvas) {
    return cull_pairs([&](const CullProblem& problem, std::vector<TrianglePair>& pairs) -> Result<void> {
        auto report = query_culler_.cull(problem, plan, canvas, pairs);
        if (!report.ok()) return report.error();
        counts_.queries = *report;
        return {};
    });
}

/// Of all triangles that hold the vertex and are not adjacent to the face, is this the first? If that pair was culled, so is the contact.
bool ChromaticCuller::speaks_for_vertex(const Side& side, Index vertex, Index triangle, Index face) const noexcept {
    for (const Index other : side.stars.of(vertex)) {
        if (other == triangle) return true;
        if (!self() || !are_adjacent(side.topology->triangles[other], side.topology->triangles[face])) return false;
    }
    return true;
}

bool ChromaticCuller::speaks_for_edges(Index edge_a, Index edge_b, const TrianglePair& pair) const noexcept {
    const auto& triangles = sides_.front().topology->triangles;
    for (const Index a : sides_.front().around_edge(edge_a))
        for (const Index b : side_b().around_edge(edge_b)) {
            if (a == pair.a && b == pair.b) return true;
            if (!self() || !are_adjacent(triangles[a], triangles[b])) return false;
        }
    return true;
}

void ChromaticCuller::add_vertex_face(const Side& vertices, const Side& faces, Index triangle, Index face,
                                      std::vector<FeaturePair>& out) const {
    const SweptBox box = faces.face_box(face);
    const float distance = round_up(distance_);
    const Triangle& t = vertices.topology->triangles[triangle];
    for (int k = 0; k < 3; ++k) {
        if (is_repeated(t, k)) continue;
        if (are_near(vertices.boxes[t[k]], box, distance) && speaks_for_vertex(vertices, t[k], triangle, face)) out.push_back({t[k], face});
    }
}

void ChromaticCuller::add_features(const TrianglePair& pair, CulledCandidates& out) const {
    const Side &a = sides_.front(), &b = side_b();
    add_vertex_face(a, b, pair.a, pair.b, out.vertex_face);
    add_vertex_face(b, a, pair.b, pair.a, self() ? out.vertex_face : out.face_vertex);
    const float distance = round_up(distance_);
    const SweptBox box_b = b.face_box(pair.b);
    const auto &edges_a = a.topology->triangle_edges[pair.a], &edges_b = b.topology->triangle_edges[pair.b];
    for (int i = 0; i < 3; ++i) {
        if (edges_a[i] == kNoIndex || is_repeated(edges_a, i)) continue;
        const SweptBox box = a.edge_box(edges_a[i]);
        if (!are_near(box, box_b, distance)) continue;
        for (int k = 0; k < 3; ++k) {
            if (edges_b[k] == kNoIndex || is_repeated(edges_b, k) || !are_near(box, b.edge_box(edges_b[k]), distance)) continue;
            const bool swap = self() && edges_a[i] > edges_b[k]; // one order for a pair, whichever triangles brought it
            const FeaturePair edges = swap ? FeaturePair{edges_b[k], edges_a[i]} : FeaturePair{edges_a[i], edges_b[k]};
            const TrianglePair speaker = swap ? TrianglePair{pair.b, pair.a} : pair;
            if (speaks_for_edges(edges.a, edges.b, speaker)) out.edge_edge.push_back(edges);
        }
    }
}

/// Features of two adjacent triangles that no pair of non-adjacent ones holds; each named by the first pair of triangles only.
/// visit(is edge pair, features)
template <class Visit>
void ChromaticCuller::for_each_orphan(const TrianglePair& pair, Visit&& visit) const {
    const Side& side = sides_.front();
    const auto& triangles = side.topology->triangles;
    const auto all_adjacent = [&](std::span<const Index> around, Index face) {
        return std::all_of(around.begin(), around.end(), [&](Index t) { return are_adjacent(triangles[t], triangles[face]); });
    };
    for (const auto& [triangle, face] : {pair, TrianglePair{pair.b, pair.a}})
        for (int k = 0; k < 3; ++k) {
            const Index vertex = triangles[triangle][k];
            if (is_repeated(triangles[triangle], k) || holds(triangles[face], vertex) || side.stars.of(vertex).front() != triangle)
                continue;
            if (all_adjacent(side.stars.of(vertex), face)) visit(false, FeaturePair{vertex, face});
        }
    const auto &firsts = side.topology->triangle_edges[pair.a], &seconds = side.topology->triangle_edges[pair.b];
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) {
            const Index first = firsts[i], second = seconds[k];
            if (first == kNoIndex || second == kNoIndex || is_repeated(firsts, i) || is_repeated(seconds, k)) continue;
            if (share_vertex(side.topology->edges[first], side.topology->edges[second])) continue;
            const auto around = side.around_edge(first), others = side.around_edge(second);
            if (around.front() != pair.a || others.front() != pair.b) continue;
            if (std::all_of(others.begin(), others.end(), [&](Index other) { return all_adjacent(around, other); }))
                visit(true, first < second ? FeaturePair{first, second} : FeaturePair{second, first});
        }
}

void ChromaticCuller::gather_orphans() {
    const Side& side = sides_.front();
    const auto& triangles = side.topology->triangles;
    std::size_t adjacent = 0;
    for (Index v = 0; v < side.topology->vertex_count(); ++v) adjacent += side.stars.of(v).size() * side.stars.of(v).size();
    orphans_listed_ = adjacent <= kMostAdjacent * (triangles.size() + 1);
    if (!orphans_listed_) return;
    std::vector<Index> others;
    for (Index a = 0; a < triangles.size(); ++a) {
        others.clear();
        for (const Index v : triangles[a])
            for (const Index b : side.stars.of(v))
                if (b > a) others.push_back(b);
        std::sort(others.begin(), others.end());
        others.erase(std::unique(others.begin(), others.end()), others.end());
        for (const Index b : others)
            for_each_orphan({a, b},
                            [this](bool edges, FeaturePair pair) { (edges ? orphan_edge_edge_ : orphan_vertex_face_).push_back(pair); });
    }
}

void ChromaticCuller::add_orphans(CulledCandidates& out) {
    const Side& side = sides_.front();
    const float distance = round_up(distance_);
    const std::size_t before = out.vertex_face.size() + out.edge_edge.size();
    const auto add = [&](bool edges, FeaturePair pair) {
        if (edges) {
            if (are_near(side.edge_box(pair.a), side.edge_box(pair.b), distance)) out.edge_edge.push_back(pair);
        } else if (are_near(side.boxes[pair.a], side.face_box(pair.b), distance)) {
            out.vertex_face.push_back(pair);
        }
    };
    for (const FeaturePair& pair : orphan_vertex_face_) add(false, pair);
    for (const FeaturePair& pair : orphan_edge_edge_) add(true, pair);
    for (const TrianglePair& pair : adjacent_) for_each_orphan(pair, add);
    counts_.orphan_pairs = out.vertex_face.size() + out.edge_edge.size() - before;
}

void ChromaticCuller::find_candidates(CulledCandidates& out) {
    out.vertex_face.clear();
    out.face_vertex.clear();
    out.edge_edge.clear();
    for (const TrianglePair& pair : pairs_) add_features(pair, out);
    if (self()) add_orphans(out);
}

} // namespace trocar::collision
