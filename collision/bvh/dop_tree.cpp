#include "collision/bvh/dop_tree.hpp"

#include "collision/bvh/tree_cuts.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numeric>

namespace trocar::collision {
namespace {

constexpr float kNothing = SweptBox::kNothing;
/// Sums and differences of ways are rounded.
constexpr double kRoundedWay = 1.0 + 0x1p-40;

void join(float* to, const float* from, std::size_t count) noexcept {
    for (std::size_t i = 0; i < count; ++i) to[i] = from[i] < to[i] ? from[i] : to[i];
}

} // namespace

struct DopTree::BuildState {
    std::span<const Vec3> positions;
    std::vector<CutItem> items;                  // [triangle_count]
    std::vector<Index> edge_stamp, vertex_stamp; // cluster that met the feature last
};

void DopTree::build(const SurfaceTopology& topology, std::span<const Vec3> positions, const TreeOptions& options) {
    assert(positions.size() == topology.vertex_count() && is_dop(options.dop));
    assert(options.arity == 2 || options.arity == 4 || options.arity == 8);
    assert(options.cluster_size >= 1 && options.cluster_size <= kMaxClusterSize);
    *this = DopTree();
    topology_ = &topology;
    options_ = options;
    if (topology.triangles.empty()) return;
    BuildState state{positions, {}, {}, {}};
    state.items = make_cut_items(topology.triangles, positions);
    state.edge_stamp.assign(topology.edges.size(), kNoIndex);
    state.vertex_stamp.assign(topology.vertex_count(), kNoIndex);
    std::vector<Index> order(topology.triangles.size());
    std::iota(order.begin(), order.end(), Index{0});
    build_node(state, order);
    node_bounds_.assign(children_.size() * 2 * slabs(), kNothing);
    cluster_bounds_.assign(clusters_.size() * 2 * slabs(), kNothing);
    bounds_.assign(ids_.size() * 2 * slabs(), kNothing);
    fresh_.assign(clusters_.size(), 0);
    node_at_.assign(children_.size() / options.arity, 0.0);
    cluster_at_.assign(clusters_.size(), 0.0);
    if (options.fine) {
        fine_vertices_.resize(topology.vertex_count());
        fine_clusters_.resize(clusters_.size());
    }
    vertex_bounds_.assign(topology.vertex_count() * 2 * slabs(), kNothing);
}

Index DopTree::build_node(BuildState& state, std::span<Index> order) {
    if (order.size() <= options_.cluster_size) return add_cluster(state, order);
    const CutPlan plan{state.items, topology_->triangles, state.positions, directions_of(options_.dop), options_.builder};
    const CutParts parts = cut_into_parts(plan, order, options_.arity, options_.cluster_size);
    const Index node = static_cast<Index>(children_.size() / options_.arity);
    children_.resize(children_.size() + options_.arity, kNoChild);
    for (std::size_t i = 0; i < parts.count; ++i) {
        const Index child = build_node(state, parts.part[i]);
        children_[node * options_.arity + i] = child;
    }
    return node;
}

void DopTree::own_features(BuildState& state, std::span<const Index> triangles, std::vector<Index>& edges,
                           std::vector<Index>& vertices) const {
    const auto cluster = static_cast<Index>(clusters_.size());
    for (const Index id : triangles) {
        for (const Index edge : topology_->triangle_edges[id])
            if (edge != kNoIndex && topology_->edge_owner[edge] == id && state.edge_stamp[edge] != cluster) {
                state.edge_stamp[edge] = cluster;
                edges.push_back(edge);
            }
        for (const Index vertex : topology_->triangles[id])
            if (topology_->vertex_owner[vertex] == id && state.vertex_stamp[vertex] != cluster) {
                state.vertex_stamp[vertex] = cluster;
                vertices.push_back(vertex);
            }
    }
}

Index DopTree::add_cluster(BuildState& state, std::span<const Index> triangles) {
    std::vector<Index> faces(triangles.begin(), triangles.end()), edges, vertices;
    std::sort(faces.begin(), faces.end());
    own_features(state, faces, edges, vertices);
    Cluster cluster;
    cluster.faces = add_blocks(faces, 3);
    cluster.edges = add_blocks(edges, 2);
    cluster.vertices = add_blocks(vertices, 1);
    cluster.touched_begin = static_cast<Index>(touched_.size());
    for (const Index id : faces) touched_.insert(touched_.end(), topology_->triangles[id].begin(), topology_->triangles[id].end());
    std::sort(touched_.begin() + cluster.touched_begin, touched_.end());
    touched_.erase(std::unique(touched_.begin() + cluster.touched_begin, touched_.end()), touched_.end());
    cluster.touched_end = static_cast<Index>(touched_.size());
    clusters_.push_back(cluster);
    return static_cast<Index>(clusters_.size() - 1) | kLeafBit;
}

DopTree::BlockRange DopTree::add_blocks(std::span<const Index> ids, int corners) {
    BlockRange range{static_cast<Index>(ids_.size() / kLanes), 0, static_cast<Index>(ids.size())};
    const std::size_t blocks = (ids.size() + kLanes - 1) / kLanes;
    ids_.resize(ids_.size() + blocks * kLanes, kNoIndex);
    corners_.resize(3 * ids_.size(), kNoIndex);
    for (std::size_t i = 0; i < ids.size(); ++i) {
        const std::size_t block = range.begin + i / kLanes, lane = i % kLanes;
        ids_[block * kLanes + lane] = ids[i];
        std::array<Index, 3> corner{ids[i], ids[i], ids[i]};
        if (corners == 3) corner = topology_->triangles[ids[i]];
        if (corners == 2) corner = {topology_->edges[ids[i]][0], topology_->edges[ids[i]][1], topology_->edges[ids[i]][0]};
        for (std::size_t k = 0; k < 3; ++k) corners_[(block * 3 + k) * kLanes + lane] = corner[k];
    }
    range.end = range.begin + static_cast<Index>(blocks);
    return range;
}

void DopTree::refit(const SurfaceMotion& motion) {
    if (empty()) return;
    refit_vertices(motion, 0, static_cast<Index>(topology_->vertex_count()));
    refit_clusters(0, static_cast<Index>(clusters_.size()));
    refit_nodes();
    std::fill(node_at_.begin(), node_at_.end(), travelled_ = 0.0);
    std::fill(cluster_at_.begin(), cluster_at_.end(), 0.0);
}

void DopTree::follow(const SurfaceMotion& motion, double way) noexcept {
    motion_ = motion;
    const double next = travelled_ + way * kRoundedWay;
    // no way, or one lost in rounding: what is asked for is still of another motion
    travelled_ = next > travelled_ ? next : std::nextafter(travelled_, std::numeric_limits<double>::infinity());
}

/// Each child by its own rows, or its cluster's bounds, as far out as the surface may have come since.
void DopTree::bring_node(Index node) noexcept {
    const std::size_t stride = 2 * slabs(), arity = options_.arity;
    const Directions directions = directions_of(options_.dop);
    for (std::size_t i = 0; i < arity; ++i) {
        const Index child = children_[node * arity + i];
        if (child == kNoChild) continue;
        const bool is_cluster = (child & kLeafBit) != 0;
        const double way = travelled_ - (is_cluster ? cluster_at_[child & ~kLeafBit] : node_at_[child]);
        float* out = node_bounds_.data() + node * stride * arity + i;
        for (std::size_t s = 0; s < stride; ++s) {
            const float* rows = child_bounds(child) + s * arity; // of a node
            const float held = is_cluster ? cluster_bounds(child & ~kLeafBit)[s] : *std::min_element(rows, rows + arity);
            out[s * arity] = way > 0.0 ? round_down(held - way * kRoundedWay * direction_length(directions[s % slabs()])) : held;
        }
    }
    node_at_[node] = travelled_;
}

void DopTree::bring_cluster(Index cluster) noexcept {
    const Directions directions = directions_of(options_.dop);
    for (const Index v : touched(cluster)) {
        float* bounds = vertex_bounds_.data() + v * 2 * slabs();
        project_vertex(motion_.t0[v], motion_.t1[v], directions, bounds, bounds + slabs());
    }
    refit_clusters(cluster, cluster + 1);
    cluster_at_[cluster] = travelled_;
}

void DopTree::refit_vertices(const SurfaceMotion& motion, Index begin, Index end) noexcept {
    const Directions directions = directions_of(options_.dop);
    const std::size_t stride = 2 * slabs();
    for (Index v = begin; v < end; ++v) {
        float* bounds = vertex_bounds_.data() + v * stride;
        project_vertex(motion.t0[v], motion.t1[v], directions, bounds, bounds + slabs());
    }
}

void DopTree::refit_clusters(Index begin, Index end) noexcept {
    switch (options_.dop) {
    case 6:
        return refit_clusters_of<3>(begin, end);
    case 14:
        return refit_clusters_of<7>(begin, end);
    case 18:
        return refit_clusters_of<9>(begin, end);
    default:
        return refit_clusters_of<13>(begin, end);
    }
}

template <std::size_t Slabs>
void DopTree::refit_clusters_of(Index begin, Index end) noexcept {
    constexpr std::size_t kStride = 2 * Slabs;
    for (Index c = begin; c < end; ++c) {
        std::array<float, kStride> joined;
        joined.fill(kNothing);
        for (const Index vertex : touched(c)) join(joined.data(), vertex_bounds_.data() + vertex * kStride, kStride);
        std::copy(joined.begin(), joined.end(), cluster_bounds_.begin() + static_cast<std::ptrdiff_t>(c * kStride));
        fresh_[c] = 0;
    }
}

void DopTree::refit_fine(Index cluster, const SurfaceMotion& motion) noexcept {
    fine_clusters_[cluster] = join_finely(motion.t0, motion.t1, touched(cluster));
    fresh_[cluster] |= kFine;
}

void DopTree::refit_fine_vertices(Index cluster, const SurfaceMotion& motion) noexcept {
    project_finely(motion.t0, motion.t1, touched(cluster), fine_vertices_);
    fresh_[cluster] |= kFineVertices;
}

void DopTree::refit_blocks(Index cluster) noexcept {
    fresh_[cluster] |= kBlocks;
    switch (options_.dop) {
    case 6:
        return refit_blocks_of<3>(clusters_[cluster]);
    case 14:
        return refit_blocks_of<7>(clusters_[cluster]);
    case 18:
        return refit_blocks_of<9>(clusters_[cluster]);
    default:
        return refit_blocks_of<13>(clusters_[cluster]);
    }
}

template <std::size_t Slabs>
void DopTree::refit_blocks_of(const Cluster& cluster) noexcept {
    refit_lanes<Slabs, 3>(cluster.faces);
    refit_lanes<Slabs, 2>(cluster.edges);
    refit_lanes<Slabs, 1>(cluster.vertices);
}

/// Bounds of a range's features, lane by lane.
template <std::size_t Slabs, std::size_t Corners>
void DopTree::refit_lanes(const BlockRange& range) noexcept {
    constexpr std::size_t kStride = 2 * Slabs;
    for (Index i = 0; i < range.count; ++i) {
        const std::size_t block = range.begin + i / kLanes, lane = i % kLanes;
        const Index* corner = corners_.data() + block * 3 * kLanes + lane;
        const float* bounds[Corners];
        for (std::size_t k = 0; k < Corners; ++k) bounds[k] = vertex_bounds_.data() + corner[k * kLanes] * kStride;
        float* out = bounds_.data() + block * kStride * kLanes + lane;
        for (std::size_t s = 0; s < kStride; ++s) {
            float joined = bounds[0][s];
            for (std::size_t k = 1; k < Corners; ++k) joined = bounds[k][s] < joined ? bounds[k][s] : joined;
            out[s * kLanes] = joined;
        }
    }
}

void DopTree::refit_nodes() noexcept {
    const std::size_t stride = 2 * slabs(), arity = options_.arity;
    for (std::size_t node = children_.size() / arity; node-- > 0;) { // children lie behind their parent
        for (std::size_t i = 0; i < arity; ++i) {
            const Index child = children_[node * arity + i];
            float* out = node_bounds_.data() + node * stride * arity + i;
            if (child == kNoChild) continue;
            if (child & kLeafBit) {
                const float* bounds = cluster_bounds(child & ~kLeafBit);
                for (std::size_t s = 0; s < stride; ++s) out[s * arity] = bounds[s];
                continue;
            }
            const float* rows = child_bounds(child);
            for (std::size_t s = 0; s < stride; ++s) out[s * arity] = *std::min_element(rows + s * arity, rows + (s + 1) * arity);
        }
    }
}

std::size_t DopTree::memory() const noexcept {
    const auto bytes = [](const auto& v) { return v.capacity() * sizeof(v[0]); };
    return bytes(children_) + bytes(node_bounds_) + bytes(clusters_) + bytes(cluster_bounds_) + bytes(bounds_) + bytes(ids_) +
           bytes(corners_) + bytes(vertex_bounds_) + bytes(touched_) + bytes(fresh_) + bytes(fine_vertices_) + bytes(fine_clusters_) +
           bytes(node_at_) + bytes(cluster_at_);
}

} // namespace trocar::collision
