#include "collision/search/surface_pair.hpp"

#include "collision/search/face_planes.hpp"
#include "collision/bvh/near_pairs.hpp"
#include "collision/ccd/pair_kinds.hpp"

#include <algorithm>
#include <cassert>

namespace trocar::collision {
namespace {

BlockRun run_of(const DopTree& tree, const DopTree::BlockRange& range, int corner_count) noexcept {
    if (range.count == 0) return {};
    return {tree.block_bounds(range.begin), tree.block_ids(range.begin), tree.block_corners(range.begin), range.count, corner_count};
}

Vec3 at(const SweptPoint& p, double t) noexcept { return (1.0 - t) * p.t0 + t * p.t1; }

CcdResult ccd_result_of(const Sweep& sweep) noexcept { return {.meets = true, .time = sweep.time, .bary = sweep.bary, .normal = sweep.normal}; }

/// Most pairs that two clusters can have: all their edges.
constexpr std::size_t kMostPairs = 9 * DopTree::kMaxClusterSize * DopTree::kMaxClusterSize;
/// Candidates whose sweeps are held at a time: few, since each one is initialised.
constexpr std::size_t kSweeps = 32;
/// A vertex, an edge, a face.
template <std::size_t Corners>
FineBounds bounds_of(const DopTree& tree, Index feature) noexcept {
    if constexpr (Corners == 1) return tree.fine_vertex(feature);
    const auto join = [&](const auto& corners) {
        FineBounds bounds = tree.fine_vertex(corners[0]);
        for (std::size_t k = 1; k < Corners; ++k) bounds.add(tree.fine_vertex(corners[k]));
        return bounds;
    };
    if constexpr (Corners == 2)
        return join(tree.topology().edges[feature]);
    else
        return join(tree.topology().triangles[feature]);
}

auto order_of(const SearchContact& c) noexcept {
    const bool vertex_face = c.contact.origin == ContactOrigin::ExactVF;
    const auto key = [](Index id) { return id == kNoIndex ? std::int64_t{-1} : std::int64_t{id}; };
    return std::array<std::int64_t, 10>{vertex_face,
                                        c.contact.a.code(),
                                        key(c.contact.feature_a[0]),
                                        key(c.contact.feature_a[1]),
                                        c.contact.b.code(),
                                        key(c.contact.feature_b[0]),
                                        key(c.contact.feature_b[1]),
                                        key(c.contact.feature_b[2]),
                                        c.id_a,
                                        c.id_b};
}

} // namespace

bool comes_before(const SearchContact& a, const SearchContact& b) noexcept { return order_of(a) < order_of(b); }

void ExactStats::add(const ExactStats& part) noexcept {
    box_tests += part.box_tests;
    cluster_pairs += part.cluster_pairs;
    candidates_vf += part.candidates_vf;
    candidates_ee += part.candidates_ee;
    hits_vf += part.hits_vf;
    hits_ee += part.hits_ee;
    exact += part.exact;
    unresolved += part.unresolved;
    safe_fraction = std::min(safe_fraction, part.safe_fraction);
    finished = finished && part.finished;
}

SurfacePair::SurfacePair(const SearchSide& a, const SearchSide& b, const PairOptions& options) noexcept : a_(a), b_(b), options_(options) {
    assert(options.distance >= 0.0 && a.tree->options() == b.tree->options());
    const Directions directions = directions_of(a.tree->options().dop);
    for (std::size_t s = 0; s < directions.size(); ++s)
        reach_[s] = options.all_pairs ? SweptBox::kNothing : round_up(options.distance * direction_length(directions[s]));
    fine_reach_ = fine_reach(options.distance);
    fine_ = a.tree->options().fine && !options.all_pairs;
}

bool SurfacePair::clusters_are_near(ClusterPair clusters) const noexcept {
    // Rows above a tree that is followed are wider than the clusters' own bounds.
    const float *a = a_.tree->cluster_bounds(clusters.a), *b = b_.tree->cluster_bounds(clusters.b);
    const std::size_t slabs = a_.tree->slabs();
    for (std::size_t s = 0; s < slabs; ++s)
        if (a[s] + b[slabs + s] > reach_[s] || a[slabs + s] + b[s] > reach_[s]) return false;
    if (!fine_) return true;
    if (!a_.tree->fine_is_fresh(clusters.a)) a_.tree->refit_fine(clusters.a, a_.motion);
    if (!b_.tree->fine_is_fresh(clusters.b)) b_.tree->refit_fine(clusters.b, b_.motion);
    return are_near(a_.tree->fine_cluster(clusters.a), b_.tree->fine_cluster(clusters.b), fine_reach_);
}

/// Moves the pairs that are near along the fine directions as well to the front, in their order.
template <std::size_t CornersA, std::size_t CornersB>
std::size_t SurfacePair::keep_near(const DopTree& tree_a, const DopTree& tree_b, std::span<FeaturePair> pairs) const noexcept {
    if (!fine_) return pairs.size();
    std::size_t kept = 0;
    Index last = kNoIndex; // pairs come by their first feature
    FineBounds a, b;
    for (const FeaturePair pair : pairs) {
        if (pair.a != last) a = bounds_of<CornersA>(tree_a, pair.a);
        last = pair.a;
        b = bounds_of<CornersB>(tree_b, pair.b);
        pairs[kept] = pair;
        kept += are_near(a, b, fine_reach_);
    }
    return kept;
}

/// Which children of a node come near a box.
std::uint32_t SurfacePair::near(const float* box, std::size_t stride, const DopTree& tree, Index node) const noexcept {
    const std::size_t arity = tree.options().arity, slabs = tree.slabs();
    return options_.simd ? near_children(box, stride, tree.child_bounds(node), arity, slabs, reach_.data())
                         : near_children_plain(box, stride, tree.child_bounds(node), arity, slabs, reach_.data());
}

bool SurfacePair::clusters_are_apart(ClusterPair clusters) const noexcept {
    if (!fine_ || !options_.planes || (within() && clusters.a == clusters.b)) return false;
    const DopTree &tree_a = *a_.tree, &tree_b = *b_.tree;
    const auto faces_of = [](const DopTree& tree, Index cluster) -> FaceRun {
        const DopTree::BlockRange& faces = tree.clusters()[cluster].faces;
        return {tree.block_corners(faces.begin), faces.count};
    };
    const double reach = options_.distance + options_.tolerance; // what the elementary tests may report
    return hull_keeps_off(a_.motion, tree_a.touched(clusters.a), b_.motion, faces_of(tree_b, clusters.b), reach) ||
           hull_keeps_off(b_.motion, tree_b.touched(clusters.b), a_.motion, faces_of(tree_a, clusters.a), reach);
}

void SurfacePair::collect(ClusterPair clusters, CandidateLists& out) const {
    const DopTree &tree_a = *a_.tree, &tree_b = *b_.tree;
    const auto [a, b] = clusters;
    assert(tree_a.blocks_are_fresh(a) && tree_b.blocks_are_fresh(b));
    assert(!fine_ || (tree_a.fine_vertices_are_fresh(a) && tree_b.fine_vertices_are_fresh(b)));
    const DopTree::Cluster &cluster_a = tree_a.clusters()[a], &cluster_b = tree_b.clusters()[b];
    const bool same = within() && a == b;
    NearTest test{.slabs = tree_a.slabs(), .distance = reach_.data(), .box_b = nullptr, .skip_shared = within()};
    std::array<FeaturePair, kMostPairs> found; // left uninitialised
    const auto append = [&]<std::size_t CornersA, std::size_t CornersB>(const DopTree& of_a, const DopTree::BlockRange& range_a,
                                                                        const DopTree& of_b, const DopTree::BlockRange& range_b,
                                                                        std::vector<FeaturePair>& list) {
        const BlockRun run_a = run_of(of_a, range_a, CornersA), run_b = run_of(of_b, range_b, CornersB);
        if (run_a.count == 0 || run_b.count == 0) return;
        std::size_t count =
            options_.simd ? near_pairs(run_a, run_b, test, found.data()) : near_pairs_plain(run_a, run_b, test, found.data());
        count = keep_near<CornersA, CornersB>(of_a, of_b, std::span(found).first(count));
        list.insert(list.end(), found.begin(), found.begin() + static_cast<std::ptrdiff_t>(count));
    };
    test.box_a = tree_a.cluster_bounds(a);
    test.box_b = tree_b.cluster_bounds(b);
    append.operator()<1, 3>(tree_a, cluster_a.vertices, tree_b, cluster_b.faces, out.vertex_face);
    test.same_run = same;
    const std::size_t before = out.edge_edge.size();
    append.operator()<2, 2>(tree_a, cluster_a.edges, tree_b, cluster_b.edges, out.edge_edge);
    test.same_run = false;
    std::swap(test.box_a, test.box_b);
    if (!same) append.operator()<1, 3>(tree_b, cluster_b.vertices, tree_a, cluster_a.faces, out.face_vertex);
    if (!within()) return;
    for (std::size_t k = before; k < out.edge_edge.size(); ++k) // the same bits whichever cluster came first
        if (out.edge_edge[k].b < out.edge_edge[k].a) std::swap(out.edge_edge[k].a, out.edge_edge[k].b);
}

void SurfacePair::decide(const CandidateLists& candidates, std::vector<SearchContact>& out, ExactStats& stats) const {
    decide_list(true, false, candidates.vertex_face, out, stats);
    decide_list(true, true, candidates.face_vertex, out, stats);
    decide_list(false, false, candidates.edge_edge, out, stats);
}

/// Of some candidates: do they meet, and where they only come within the distance, the rest of their sweeps' results.
struct SurfacePair::Verdicts {
    std::array<CcdResult, kSweeps> ccd_results;
    std::array<Sweep, kSweeps> sweeps; // where the distance is > 0
};

void SurfacePair::sweep(bool vertex_face, const SearchSide& a, const SearchSide& b, std::span<const FeaturePair> pairs,
                        Verdicts& out) const {
    const SweepLimits limits{.distance = options_.distance, .tolerance = options_.tolerance};
    if (vertex_face)
        sweep_vertex_faces(a.motion, b.motion, pairs, limits, out.sweeps);
    else
        sweep_edge_edges(a.motion, b.motion, pairs, limits, out.sweeps);
    for (std::size_t i = 0; i < pairs.size(); ++i) {
        out.ccd_results[i].meets = out.sweeps[i].hit();
        if (out.ccd_results[i].meets) out.ccd_results[i] = ccd_result_of(out.sweeps[i]);
    }
}

void SurfacePair::decide_list(bool vertex_face, bool swapped, std::span<const FeaturePair> pairs, std::vector<SearchContact>& out,
                              ExactStats& stats) const {
    const SearchSide &a = swapped ? b_ : a_, &b = swapped ? a_ : b_;
    const bool exact = options_.distance == 0.0;
    Verdicts verdicts;
    for (std::size_t first = 0; first < pairs.size(); first += kSweeps) {
        const auto part = pairs.subspan(first, std::min(kSweeps, pairs.size() - first));
        if (!exact)
            sweep(vertex_face, a, b, part, verdicts);
        else if (vertex_face)
            ccd_vertex_faces(a.motion, b.motion, part, verdicts.ccd_results);
        else
            ccd_edge_edges(a.motion, b.motion, part, verdicts.ccd_results);
        for (std::size_t i = 0; i < part.size(); ++i) {
            const CcdResult& ccd = verdicts.ccd_results[i];
            stats.exact += ccd.decided_by == Decision::Exact;
            if (!ccd.meets) continue;
            stats.unresolved += !exact && verdicts.sweeps[i].outcome == SweepOutcome::Unresolved;
            stats.safe_fraction = std::min(stats.safe_fraction, exact ? ccd.time : verdicts.sweeps[i].safe_time);
            ++(vertex_face ? stats.hits_vf : stats.hits_ee);
            SearchContact& found = out.emplace_back();
            if (vertex_face)
                make_vertex_face(a, b, part[i], ccd, found);
            else
                make_edge_edge(part[i], ccd, found);
            found.contact.a = a.thing;
            found.contact.b = b.thing;
        }
    }
}

/// Fields common to contacts of both kinds; the point is still to be summed.
static Contact& describe(FeaturePair pair, ContactOrigin origin, const CcdResult& ccd, SearchContact& found) {
    found.id_a = pair.a;
    found.id_b = pair.b;
    Contact& contact = found.contact;
    contact.origin = origin;
    contact.time = ccd.time;
    contact.normal = ccd.normal;
    contact.point = Vec3::Zero();
    return contact;
}

void SurfacePair::make_vertex_face(const SearchSide& a, const SearchSide& b, FeaturePair pair, const CcdResult& ccd,
                                   SearchContact& found) {
    const Triangle& t = b.motion.topology->triangles[pair.b];
    const SweptPoint vertex = swept(a.motion, pair.a);
    const auto face = swept(b.motion, t);
    Contact& c = describe(pair, ContactOrigin::ExactVF, ccd, found);
    c.feature_a[0] = pair.a;
    Vec3 end = Vec3::Zero(); // where the face's nearest point goes
    for (std::size_t k = 0; k < 3; ++k) {
        c.feature_b[k] = t[k];
        c.bary_b[k] = ccd.bary[k];
        c.point += ccd.bary[k] * at(face[k], ccd.time);
        end += ccd.bary[k] * face[k].t1;
    }
    c.gap = ccd.normal.dot(vertex.t1 - end);
}

void SurfacePair::make_edge_edge(FeaturePair pair, const CcdResult& ccd, SearchContact& found) const {
    const Edge &e = a_.motion.topology->edges[pair.a], &f = b_.motion.topology->edges[pair.b];
    const auto a = swept(a_.motion, e), b = swept(b_.motion, f);
    Contact& c = describe(pair, ContactOrigin::ExactEE, ccd, found);
    c.bary_b[2] = 0.0;
    Vec3 offset = Vec3::Zero(); // from b's nearest point to a's at t1
    for (std::size_t k = 0; k < 2; ++k) {
        c.feature_a[k] = e[k];
        c.feature_b[k] = f[k];
        c.bary_a[k] = k == 0 ? 1.0 - ccd.bary[0] : ccd.bary[0];
        c.bary_b[k] = k == 0 ? 1.0 - ccd.bary[1] : ccd.bary[1];
        c.point += c.bary_b[k] * at(b[k], ccd.time);
        offset += c.bary_a[k] * a[k].t1 - c.bary_b[k] * b[k].t1;
    }
    c.gap = ccd.normal.dot(offset);
}

} // namespace trocar::collision
