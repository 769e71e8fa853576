#include "collision/contact_search.hpp"

#include "collision/near_pairs.hpp"

#include <algorithm>
#include <atomic>
#include <cassert>
#include <thread>

namespace seldinger::collision {
namespace {

/// Pairs of clusters that one thread takes at a time. The chunks, not the threads, give the order of the answer.
constexpr std::size_t kChunk = 512;
/// Vertices or clusters of one piece of a refit.
constexpr std::size_t kRefitPiece = 2048;

BlockRun run_of(const DopTree& tree, const DopTree::BlockRange& range, int corner_count) noexcept {
    if (range.count == 0) return {};
    return {tree.block_bounds(range.begin), tree.block_ids(range.begin), tree.block_corners(range.begin), range.count, corner_count};
}

SweptPoint swept(const SurfaceMotion& motion, Index vertex) noexcept { return {motion.t0[vertex], motion.t1[vertex]}; }
std::array<SweptPoint, 2> swept(const SurfaceMotion& motion, const Edge& e) noexcept { return {swept(motion, e[0]), swept(motion, e[1])}; }
std::array<SweptPoint, 3> swept(const SurfaceMotion& motion, const Triangle& t) noexcept {
    return {swept(motion, t[0]), swept(motion, t[1]), swept(motion, t[2])};
}
Vec3 at(const SweptPoint& p, double t) noexcept { return (1.0 - t) * p.t0 + t * p.t1; }

Meeting meeting_of(const Sweep& sweep) noexcept {
    return {.meets = true, .time = sweep.time, .bary = sweep.bary, .normal = sweep.normal};
}

/// Most pairs that two clusters can have: all their edges.
constexpr std::size_t kMostPairs = 9 * DopTree::kMaxClusterSize * DopTree::kMaxClusterSize;

auto order_of(const SearchContact& c) noexcept {
    const bool vertex_face = c.contact.origin == ContactOrigin::ExactVF;
    const auto key = [](Index id) { return id == kNoIndex ? std::int64_t{-1} : std::int64_t{id}; };
    return std::array<std::int64_t, 10>{vertex_face, c.contact.body_a, key(c.contact.feature_a[0]), key(c.contact.feature_a[1]), c.contact.body_b,
                                        key(c.contact.feature_b[0]), key(c.contact.feature_b[1]), key(c.contact.feature_b[2]), c.id_a, c.id_b};
}

} // namespace

/// Work on 0 .. count - 1, each once, on as many threads as asked for. Work must not depend on which thread it is.
template <class Work>
void ContactSearch::parallel(std::size_t count, const Work& work) const {
    const std::size_t threads = std::min<std::size_t>(options_.threads, count);
    if (threads <= 1) {
        for (std::size_t i = 0; i < count; ++i) work(i);
        return;
    }
    std::atomic<std::size_t> next = 0;
    const auto take = [&] {
        for (std::size_t i = next++; i < count; i = next++) work(i);
    };
    std::vector<std::jthread> others;
    for (std::size_t t = 1; t < threads; ++t) others.emplace_back(take);
    take();
}

void ContactSearch::build(std::span<const SurfaceTopology* const> surfaces, std::span<const std::span<const Vec3>> positions,
                          const SearchOptions& options) {
    assert(surfaces.size() == positions.size() && options.distance >= 0.0);
    options_ = options;
    trees_.assign(surfaces.size(), DopTree());
    for (std::size_t i = 0; i < surfaces.size(); ++i) trees_[i].build(*surfaces[i], positions[i], options.tree);
    jobs_.clear();
    for (BodyId a = 0; a < surfaces.size(); ++a)
        for (BodyId b = a; b < surfaces.size(); ++b)
            if (a == b ? options.within : options.between) jobs_.push_back({a, b, {}, {}, {}, {}});
    const Directions directions = directions_of(options.tree.dop);
    for (std::size_t s = 0; s < directions.size(); ++s) reach_[s] = options.all_pairs ? SweptBox::kNothing : round_up(options.distance * direction_length(directions[s]));
}

void ContactSearch::refit(std::span<const SurfaceMotion> motions) {
    assert(motions.size() == trees_.size());
    motions_.assign(motions.begin(), motions.end());
    const auto pieces = [](std::size_t count) { return (count + kRefitPiece - 1) / kRefitPiece; };
    const auto piece_end = [](std::size_t piece, std::size_t count) { return static_cast<Index>(std::min((piece + 1) * kRefitPiece, count)); };
    for (std::size_t i = 0; i < trees_.size(); ++i) {
        DopTree& tree = trees_[i];
        if (tree.empty()) continue;
        const std::size_t vertices = tree.topology().vertex_count(), clusters = tree.clusters().size();
        parallel(pieces(vertices), [&](std::size_t p) { tree.refit_vertices(motions_[i], static_cast<Index>(p * kRefitPiece), piece_end(p, vertices)); });
        parallel(pieces(clusters), [&](std::size_t p) { tree.refit_clusters(static_cast<Index>(p * kRefitPiece), piece_end(p, clusters)); });
        tree.refit_nodes();
    }
}

void ContactSearch::traverse(Job& job) {
    job.cluster_pairs.clear();
    const DopTree &tree_a = trees_[job.a], &tree_b = trees_[job.b];
    if (tree_a.empty() || tree_b.empty()) return;
    const bool self = job.a == job.b;
    const std::size_t arity = options_.tree.arity, slabs = tree_a.slabs();
    const auto test = [&](const float* box, std::size_t stride, const DopTree& tree, Index node) {
        ++stats_.box_tests;
        return options_.simd ? near_children(box, stride, tree.child_bounds(node), arity, slabs, reach_.data())
                             : near_children_plain(box, stride, tree.child_bounds(node), arity, slabs, reach_.data());
    };
    const auto push = [&](Index a, Index b) {
        if ((a & b & DopTree::kLeafBit) != 0) job.cluster_pairs.push_back({a & ~DopTree::kLeafBit, b & ~DopTree::kLeafBit});
        else stack_.push_back({a, b});
    };
    stack_.clear();
    push(tree_a.root(), tree_b.root());
    while (!stack_.empty()) {
        const auto [a, b] = stack_.back();
        stack_.pop_back();
        if ((a & DopTree::kLeafBit) != 0 || (b & DopTree::kLeafBit) != 0) { // a cluster against a node's children
            const bool a_is_leaf = (a & DopTree::kLeafBit) != 0;
            const DopTree &leaf_tree = a_is_leaf ? tree_a : tree_b, &node_tree = a_is_leaf ? tree_b : tree_a;
            const Index leaf = a_is_leaf ? a : b, node = a_is_leaf ? b : a;
            const auto children = node_tree.children(node);
            for (std::uint32_t near = test(leaf_tree.cluster_bounds(leaf & ~DopTree::kLeafBit), 1, node_tree, node); near != 0; near &= near - 1) {
                const Index child = children[static_cast<std::size_t>(__builtin_ctz(near))];
                if (child != DopTree::kNoChild) push(a_is_leaf ? leaf : child, a_is_leaf ? child : leaf);
            }
            continue;
        }
        const auto children_a = tree_a.children(a), children_b = tree_b.children(b);
        for (std::size_t i = 0; i < arity && children_a[i] != DopTree::kNoChild; ++i) {
            std::uint32_t near = test(tree_a.child_bounds(a) + i, arity, tree_b, b);
            if (self && a == b) near = (near | 1u << i) & ~((1u << i) - 1u); // each pair once, and each child with itself
            for (; near != 0; near &= near - 1) {
                const Index child = children_b[static_cast<std::size_t>(__builtin_ctz(near))];
                if (child != DopTree::kNoChild) push(children_a[i], child);
            }
        }
    }
    stats_.cluster_pairs += job.cluster_pairs.size();
}

void ContactSearch::collect(Job& job, std::size_t chunk) {
    const DopTree &tree_a = trees_[job.a], &tree_b = trees_[job.b];
    const bool self = job.a == job.b;
    auto &vertex_face = job.vertex_face[chunk], &face_vertex = job.face_vertex[chunk], &edge_edge = job.edge_edge[chunk];
    for (auto* list : {&vertex_face, &face_vertex, &edge_edge}) list->clear();
    NearTest test{.slabs = tree_a.slabs(), .distance = reach_.data(), .box_b = nullptr, .skip_shared = self};
    std::array<FeaturePair, kMostPairs> found; // left uninitialised
    const auto append = [&](const BlockRun& a, const BlockRun& b, const float* box_b, bool same_run, std::vector<FeaturePair>& out) {
        if (a.count == 0 || b.count == 0) return;
        test.box_b = box_b;
        test.same_run = same_run;
        const std::size_t count = options_.simd ? near_pairs(a, b, test, found.data()) : near_pairs_plain(a, b, test, found.data());
        out.insert(out.end(), found.begin(), found.begin() + static_cast<std::ptrdiff_t>(count));
    };
    const std::size_t end = std::min((chunk + 1) * kChunk, job.cluster_pairs.size());
    for (std::size_t i = chunk * kChunk; i < end; ++i) {
        const auto [a, b] = job.cluster_pairs[i];
        const DopTree::Cluster &cluster_a = tree_a.clusters()[a], &cluster_b = tree_b.clusters()[b];
        const bool same = self && a == b;
        const float *box_a = tree_a.cluster_bounds(a), *box_b = tree_b.cluster_bounds(b);
        append(run_of(tree_a, cluster_a.vertices, 1), run_of(tree_b, cluster_b.faces, 3), box_b, false, vertex_face);
        if (!same) append(run_of(tree_b, cluster_b.vertices, 1), run_of(tree_a, cluster_a.faces, 3), box_a, false, face_vertex);
        const std::size_t before = edge_edge.size();
        append(run_of(tree_a, cluster_a.edges, 2), run_of(tree_b, cluster_b.edges, 2), box_b, same, edge_edge);
        if (!self) continue;
        for (std::size_t k = before; k < edge_edge.size(); ++k) // the same bits whichever cluster came first
            if (edge_edge[k].b < edge_edge[k].a) std::swap(edge_edge[k].a, edge_edge[k].b);
    }
}

void ContactSearch::find_candidates() {
    stats_ = {};
    for (Job& job : jobs_) {
        traverse(job);
        const std::size_t chunks = (job.cluster_pairs.size() + kChunk - 1) / kChunk;
        for (auto* lists : {&job.vertex_face, &job.face_vertex, &job.edge_edge}) lists->resize(chunks);
        parallel(chunks, [&](std::size_t chunk) { collect(job, chunk); });
        for (std::size_t chunk = 0; chunk < chunks; ++chunk) {
            stats_.candidates_vf += job.vertex_face[chunk].size() + job.face_vertex[chunk].size();
            stats_.candidates_ee += job.edge_edge[chunk].size();
        }
    }
}

void ContactSearch::start_given(std::span<const SurfaceMotion> motions) {
    motions_.assign(motions.begin(), motions.end());
    stats_ = {};
    for (Job& job : jobs_)
        for (auto* lists : {&job.vertex_face, &job.face_vertex, &job.edge_edge}) lists->clear();
}

void ContactSearch::give_candidates(BodyId a, BodyId b, std::span<const FeaturePair> vertex_face, std::span<const FeaturePair> face_vertex,
                                    std::span<const FeaturePair> edge_edge) {
    constexpr std::size_t kGivenChunk = 4096; // pairs that one thread decides at a time
    for (Job& job : jobs_) {
        if (job.a != a || job.b != b) continue;
        const std::size_t chunks = (std::max({vertex_face.size(), face_vertex.size(), edge_edge.size()}) + kGivenChunk - 1) / kGivenChunk;
        const auto deal = [&](std::span<const FeaturePair> pairs, std::vector<std::vector<FeaturePair>>& lists) {
            lists.assign(chunks, {});
            for (std::size_t i = 0; i < pairs.size(); i += kGivenChunk) {
                const auto piece = pairs.subspan(i, std::min(kGivenChunk, pairs.size() - i));
                lists[i / kGivenChunk].assign(piece.begin(), piece.end());
            }
        };
        deal(vertex_face, job.vertex_face);
        deal(face_vertex, job.face_vertex);
        deal(edge_edge, job.edge_edge);
    }
    stats_.candidates_vf += vertex_face.size() + face_vertex.size();
    stats_.candidates_ee += edge_edge.size();
}

void ContactSearch::add_hits(const Job& job, bool vertex_face, bool swapped, std::span<const FeaturePair> pairs, std::vector<Sweep>& sweeps,
                             std::vector<SearchContact>& out, SearchStats& stats) const {
    const BodyId body_a = swapped ? job.b : job.a, body_b = swapped ? job.a : job.b;
    const SurfaceMotion &a = motions_[body_a], &b = motions_[body_b];
    if (sweeps.size() < pairs.size()) sweeps.resize(pairs.size());
    const SweepLimits limits{.distance = options_.distance, .tolerance = options_.tolerance};
    if (vertex_face) sweep_vertex_faces(a, b, pairs, limits, sweeps);
    else sweep_edge_edges(a, b, pairs, limits, sweeps);
    for (std::size_t i = 0; i < pairs.size(); ++i) {
        if (!sweeps[i].hit()) continue;
        auto [id_a, id_b] = pairs[i];
        Meeting meeting = meeting_of(sweeps[i]);
        SearchContact found;
        Contact& c = found.contact;
        if (vertex_face) {
            const Triangle& t = b.topology->triangles[id_b];
            if (options_.distance == 0.0) meeting = decide_vertex_face(swept(a, id_a), swept(b, t), sweeps[i].time);
            c.origin = ContactOrigin::ExactVF;
            c.feature_a[0] = id_a;
            c.point = Vec3::Zero();
            for (std::size_t k = 0; k < 3; ++k) {
                c.feature_b[k] = t[k];
                c.bary_b[k] = meeting.bary[k];
                c.point += meeting.bary[k] * at(swept(b, t[k]), meeting.time);
            }
        } else {
            // within one surface the edge of smaller vertex ids comes first
            if (body_a == body_b && id_b < id_a) std::swap(id_a, id_b);
            const bool turned = id_a != pairs[i].a;
            const Edge &e = a.topology->edges[id_a], &f = b.topology->edges[id_b];
            if (options_.distance == 0.0) meeting = decide_edge_edge(swept(a, e), swept(b, f), sweeps[i].time);
            else if (turned) {
                std::swap(meeting.bary[0], meeting.bary[1]);
                meeting.normal = -meeting.normal;
            }
            c.origin = ContactOrigin::ExactEE;
            std::copy(e.begin(), e.end(), c.feature_a);
            std::copy(f.begin(), f.end(), c.feature_b);
            c.bary_a[0] = 1.0 - meeting.bary[0];
            c.bary_a[1] = meeting.bary[0];
            c.bary_b[0] = 1.0 - meeting.bary[1];
            c.bary_b[1] = meeting.bary[1];
            c.point = c.bary_b[0] * at(swept(b, f[0]), meeting.time) + c.bary_b[1] * at(swept(b, f[1]), meeting.time);
        }
        stats.exact += meeting.decided_by == Decision::Exact;
        if (!meeting.meets) continue;
        stats.unresolved += options_.distance > 0.0 && sweeps[i].outcome == SweepOutcome::Unresolved;
        ++(vertex_face ? stats.hits_vf : stats.hits_ee);
        c.body_a = body_a;
        c.body_b = body_b;
        c.time = meeting.time;
        c.normal = meeting.normal;
        c.gap = sweeps[i].gap;
        found.id_a = id_a;
        found.id_b = id_b;
        out.push_back(found);
    }
}

void ContactSearch::decide(std::vector<SearchContact>& contacts) {
    contacts.clear();
    struct Part {
        std::vector<SearchContact> contacts;
        SearchStats stats;
    };
    for (const Job& job : jobs_) {
        std::vector<Part> parts(job.edge_edge.size());
        parallel(parts.size(), [&](std::size_t chunk) {
            std::vector<Sweep> sweeps;
            Part& part = parts[chunk];
            add_hits(job, true, false, job.vertex_face[chunk], sweeps, part.contacts, part.stats);
            add_hits(job, true, true, job.face_vertex[chunk], sweeps, part.contacts, part.stats);
            add_hits(job, false, false, job.edge_edge[chunk], sweeps, part.contacts, part.stats);
        });
        for (const Part& part : parts) {
            contacts.insert(contacts.end(), part.contacts.begin(), part.contacts.end());
            stats_.hits_vf += part.stats.hits_vf;
            stats_.hits_ee += part.stats.hits_ee;
            stats_.exact += part.stats.exact;
            stats_.unresolved += part.stats.unresolved;
        }
    }
    std::sort(contacts.begin(), contacts.end(), [](const SearchContact& a, const SearchContact& b) { return order_of(a) < order_of(b); });
}

} // namespace seldinger::collision
