#include "collision/search/contact_search.hpp"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cassert>

namespace trocar::collision {
namespace {

/// Pairs of clusters in a chunk.
constexpr std::size_t kChunk = 512;
/// Candidates of a kind in a chunk that was given.
constexpr std::size_t kGivenChunk = 4096;
/// Vertices or clusters of one piece of a refit.
constexpr std::size_t kRefitPiece = 2048;

std::size_t pieces_of(std::size_t count, std::size_t piece) noexcept { return (count + piece - 1) / piece; }

} // namespace

/// Work on 0 .. count - 1, each once, on as many threads as asked for. Work must not depend on which thread it is.
template <class Work>
void ContactSearch::parallel(std::size_t count, const Work& work) const {
    if (options_.threads <= 1 || count <= 1) {
        for (std::size_t i = 0; i < count; ++i) work(i);
        return;
    }
    tbb::task_arena arena(static_cast<int>(options_.threads));
    arena.execute([&] { tbb::parallel_for(std::size_t{0}, count, work); });
}

void ContactSearch::build(std::span<const SurfaceTopology* const> surfaces, std::span<const std::span<const Vec3>> positions,
                          const SearchOptions& options) {
    assert(surfaces.size() == positions.size());
    options_ = options;
    trees_.assign(surfaces.size(), DopTree());
    stale_.assign(surfaces.size(), {});
    wanted_.assign(surfaces.size(), {});
    for (std::size_t i = 0; i < surfaces.size(); ++i) {
        trees_[i].build(*surfaces[i], positions[i], options.tree);
        wanted_[i].assign(trees_[i].clusters().size(), 0);
    }
    jobs_.clear();
    for (SurfaceIndex a = 0; a < surfaces.size(); ++a)
        for (SurfaceIndex b = a; b < surfaces.size(); ++b)
            if (a == b ? options.within : options.between) jobs_.push_back({.a = a, .b = b, .pair = {}, .cluster_pairs = {}, .chunks = {}});
}

void ContactSearch::set_motions(std::span<const SurfaceMotion> motions) {
    assert(motions.size() == trees_.size());
    motions_.assign(motions.begin(), motions.end());
    for (Job& job : jobs_)
        job.pair = SurfacePair({Thing::body(job.a), &trees_[job.a], motions_[job.a]}, {Thing::body(job.b), &trees_[job.b], motions_[job.b]}, options_);
}

void ContactSearch::refit(std::span<const SurfaceMotion> motions) {
    set_motions(motions);
    const auto piece_end = [](std::size_t piece, std::size_t count) {
        return static_cast<Index>(std::min((piece + 1) * kRefitPiece, count));
    };
    for (std::size_t i = 0; i < trees_.size(); ++i) {
        DopTree& tree = trees_[i];
        if (tree.empty()) continue;
        const std::size_t vertices = tree.topology().vertex_count(), clusters = tree.clusters().size();
        parallel(pieces_of(vertices, kRefitPiece),
                 [&](std::size_t p) { tree.refit_vertices(motions_[i], static_cast<Index>(p * kRefitPiece), piece_end(p, vertices)); });
        parallel(pieces_of(clusters, kRefitPiece),
                 [&](std::size_t p) { tree.refit_clusters(static_cast<Index>(p * kRefitPiece), piece_end(p, clusters)); });
        tree.refit_nodes();
    }
}

void ContactSearch::use_chunks(Job& job, std::size_t count) {
    if (job.chunks.size() < count) job.chunks.resize(count); // existing ones keep their capacity
    job.chunk_count = count;
    for (std::size_t i = 0; i < count; ++i) {
        job.chunks[i].candidates.clear();
        job.chunks[i].contacts.clear();
        job.chunks[i].stats = {};
    }
}

/// Blocks of all clusters that take part, each once.
void ContactSearch::refit_blocks(const Job& job) {
    for (auto& list : stale_) list.clear();
    const auto want = [this](SurfaceIndex body, Index cluster) {
        if (trees_[body].blocks_are_fresh(cluster) || wanted_[body][cluster] != 0) return;
        wanted_[body][cluster] = 1;
        stale_[body].push_back(cluster);
    };
    for (const ClusterPair& at : job.cluster_pairs) {
        want(job.a, at.a);
        want(job.b, at.b);
    }
    for (const SurfaceIndex body : {job.a, job.b}) {
        std::vector<Index>& list = stale_[body];
        for (const Index cluster : list) wanted_[body][cluster] = 0;
        if (options_.tree.fine)
            for (const Index cluster : list) trees_[body].refit_fine_vertices(cluster, motions_[body]);
        constexpr std::size_t kPiece = 256;
        parallel(pieces_of(list.size(), kPiece), [&](std::size_t p) {
            for (std::size_t i = p * kPiece; i < std::min((p + 1) * kPiece, list.size()); ++i) trees_[body].refit_blocks(list[i]);
        });
        if (job.a == job.b) break;
    }
}

void ContactSearch::find_candidates() {
    stats_ = {};
    for (Job& job : jobs_) {
        job.cluster_pairs.clear();
        traversal_.start(job.pair);
        while (traversal_.advance(job.pair, kChunk, job.cluster_pairs)) {
        }
        stats_.box_tests += traversal_.box_tests();
        stats_.cluster_pairs += job.cluster_pairs.size();
        if (options_.tree.fine) std::erase_if(job.cluster_pairs, [&](const ClusterPair& at) { return job.pair.clusters_are_apart(at); });
        refit_blocks(job);
        use_chunks(job, pieces_of(job.cluster_pairs.size(), kChunk));
        parallel(job.chunk_count, [&](std::size_t i) {
            const std::size_t end = std::min((i + 1) * kChunk, job.cluster_pairs.size());
            for (std::size_t k = i * kChunk; k < end; ++k) job.pair.collect(job.cluster_pairs[k], job.chunks[i].candidates);
        });
        for (std::size_t i = 0; i < job.chunk_count; ++i) {
            const CandidateLists& found = job.chunks[i].candidates;
            stats_.candidates_vf += found.vertex_face.size() + found.face_vertex.size();
            stats_.candidates_ee += found.edge_edge.size();
        }
    }
}

void ContactSearch::start_given(std::span<const SurfaceMotion> motions) {
    set_motions(motions);
    stats_ = {};
    for (Job& job : jobs_) use_chunks(job, 0);
}

void ContactSearch::give_candidates(SurfaceIndex a, SurfaceIndex b, std::span<const FeaturePair> vertex_face, std::span<const FeaturePair> face_vertex,
                                    std::span<const FeaturePair> edge_edge) {
    for (Job& job : jobs_) {
        if (job.a != a || job.b != b) continue;
        use_chunks(job, pieces_of(std::max({vertex_face.size(), face_vertex.size(), edge_edge.size()}), kGivenChunk));
        const auto deal = [&](std::span<const FeaturePair> pairs, std::vector<FeaturePair> CandidateLists::*list) {
            for (std::size_t i = 0; i < pairs.size(); i += kGivenChunk) {
                const auto piece = pairs.subspan(i, std::min(kGivenChunk, pairs.size() - i));
                (job.chunks[i / kGivenChunk].candidates.*list).assign(piece.begin(), piece.end());
            }
        };
        deal(vertex_face, &CandidateLists::vertex_face);
        deal(face_vertex, &CandidateLists::face_vertex);
        deal(edge_edge, &CandidateLists::edge_edge);
        if (a != b) continue;
        for (std::size_t i = 0; i < job.chunk_count; ++i) // within one surface the edge of smaller vertex ids comes first
            for (FeaturePair& pair : job.chunks[i].candidates.edge_edge)
                if (pair.b < pair.a) std::swap(pair.a, pair.b);
    }
    stats_.candidates_vf += vertex_face.size() + face_vertex.size();
    stats_.candidates_ee += edge_edge.size();
}

void ContactSearch::decide(std::vector<SearchContact>& contacts) {
    contacts.clear();
    for (Job& job : jobs_) {
        parallel(job.chunk_count, [&](std::size_t i) {
            Chunk& chunk = job.chunks[i];
            chunk.contacts.clear();
            chunk.stats = {};
            job.pair.decide(chunk.candidates, chunk.contacts, chunk.stats);
        });
        for (std::size_t i = 0; i < job.chunk_count; ++i) {
            contacts.insert(contacts.end(), job.chunks[i].contacts.begin(), job.chunks[i].contacts.end());
            stats_.add(job.chunks[i].stats);
        }
    }
    std::sort(contacts.begin(), contacts.end(), comes_before);
}

} // namespace trocar::collision
