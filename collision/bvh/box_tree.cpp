#include "collision/bvh/box_tree.hpp"

#include "base/box.hpp"

#include <algorithm>
#include <cassert>
#include <numeric>

namespace trocar::collision {
namespace {

BoxTree::Range close_range(Index begin, const std::vector<Index>& ids) { return {begin, static_cast<Index>(ids.size())}; }

} // namespace

void BoxTree::build(const SurfaceTopology& topology, std::span<const Vec3> positions) {
    assert(positions.size() == topology.vertex_count());
    *this = BoxTree();
    topology_ = &topology;
    if (topology.triangles.empty()) return;
    std::vector<Vec3> centres;
    centres.reserve(topology.triangles.size());
    for (const Triangle& t : topology.triangles) {
        const Vec3 centre = (positions[t[0]] + positions[t[1]] + positions[t[2]]) / 3.0;
        centres.push_back(is_finite(centre) ? centre : Vec3::Zero()); // an order needs comparable numbers
    }
    std::vector<Index> order(centres.size());
    std::iota(order.begin(), order.end(), Index{0});
    nodes_.emplace_back();
    parents_.push_back(kNoIndex);
    split(0, order, centres);
    gather_features();
    refit({&topology, positions, positions});
}

void BoxTree::split(Index node, std::span<Index> order, std::span<const Vec3> centres) {
    if (order.size() <= kClusterSize) return add_cluster(node, order);
    Box3 bounds;
    for (const Index id : order) bounds.add(centres[id]);
    int axis = 0;
    bounds.extent().maxCoeff(&axis);
    // whole clusters to the left, so that only one in the tree is not full
    const std::size_t clusters = (order.size() + kClusterSize - 1) / kClusterSize;
    const std::size_t middle = clusters / 2 * kClusterSize;
    std::nth_element(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(middle), order.end(),
                     [&](Index a, Index b) { return centres[a][axis] != centres[b][axis] ? centres[a][axis] < centres[b][axis] : a < b; });
    const Index left = static_cast<Index>(nodes_.size());
    nodes_[node].left = left;
    nodes_.resize(nodes_.size() + 2);
    parents_.resize(nodes_.size(), node);
    split(left, order.first(middle), centres);
    split(left + 1, order.subspan(middle), centres);
}

void BoxTree::add_cluster(Index node, std::span<const Index> triangles) {
    nodes_[node].cluster = static_cast<Index>(clusters_.size());
    Cluster cluster;
    cluster.node = node;
    const Index begin = static_cast<Index>(triangle_ids_.size());
    triangle_ids_.insert(triangle_ids_.end(), triangles.begin(), triangles.end());
    std::sort(triangle_ids_.begin() + begin, triangle_ids_.end());
    cluster.triangles = close_range(begin, triangle_ids_);
    clusters_.push_back(cluster);
}

void BoxTree::gather_features() {
    std::vector<std::array<Index, 2>> holders; // vertex, cluster
    for (Index c = 0; c < clusters_.size(); ++c) {
        Cluster& cluster = clusters_[c];
        const Index first_edge = static_cast<Index>(edge_ids_.size());
        const Index first_vertex = static_cast<Index>(vertex_ids_.size());
        const Index first_touched = static_cast<Index>(touched_ids_.size());
        for (Index k = cluster.triangles.begin; k < cluster.triangles.end; ++k) {
            const Index id = triangle_ids_[k];
            for (const Index edge : topology_->triangle_edges[id])
                if (edge != kNoIndex && topology_->edge_owner[edge] == id &&
                    std::find(edge_ids_.begin() + first_edge, edge_ids_.end(), edge) == edge_ids_.end())
                    edge_ids_.push_back(edge);
            for (const Index vertex : topology_->triangles[id]) {
                if (std::find(touched_ids_.begin() + first_touched, touched_ids_.end(), vertex) != touched_ids_.end()) continue;
                touched_ids_.push_back(vertex);
                holders.push_back({vertex, c});
            }
        }
        for (Index k = first_touched; k < touched_ids_.size(); ++k) {
            const Index owner = topology_->vertex_owner[touched_ids_[k]];
            const auto begin = triangle_ids_.begin() + cluster.triangles.begin, end = triangle_ids_.begin() + cluster.triangles.end;
            if (std::binary_search(begin, end, owner)) vertex_ids_.push_back(touched_ids_[k]);
        }
        cluster.edges = close_range(first_edge, edge_ids_);
        cluster.vertices = close_range(first_vertex, vertex_ids_);
        cluster.touched = close_range(first_touched, touched_ids_);
    }
    std::sort(holders.begin(), holders.end());
    vertex_cluster_begin_.assign(topology_->vertex_count() + 1, 0);
    for (const auto& [vertex, cluster] : holders) {
        ++vertex_cluster_begin_[vertex + 1];
        vertex_clusters_.push_back(cluster);
    }
    std::partial_sum(vertex_cluster_begin_.begin(), vertex_cluster_begin_.end(), vertex_cluster_begin_.begin());
    moving_.resize(topology_->vertex_count());
    triangle_boxes_.resize(triangle_ids_.size());
    edge_boxes_.resize(edge_ids_.size());
    vertex_boxes_.resize(vertex_ids_.size());
    boxes_made_.assign(clusters_.size(), 0);
    dirty_.assign(nodes_.size(), 0);
}

void BoxTree::refit_node(Node& node) const {
    if (node.left != kNoIndex) {
        node.box = nodes_[node.left].box;
        node.box.add(nodes_[node.left + 1].box);
        return;
    }
    const Range touched = clusters_[node.cluster].touched;
    SweptBox box;
    for (Index k = touched.begin; k < touched.end; ++k) box.add(moving_[touched_ids_[k]]);
    node.box = box;
}

void BoxTree::refit(const SurfaceMotion& motion) {
    if (empty()) return;
    assert(motion.t0.size() == topology_->vertex_count() && motion.t1.size() == motion.t0.size());
    for (std::size_t v = 0; v < moving_.size(); ++v) moving_[v] = make_swept_box(motion.t0[v], motion.t1[v]);
    std::fill(boxes_made_.begin(), boxes_made_.end(), std::uint8_t{0});
    for (std::size_t i = nodes_.size(); i-- > 0;) refit_node(nodes_[i]);
}

void BoxTree::refit_moved(const SurfaceMotion& motion, std::span<const Index> moved) {
    if (empty()) return;
    for (const Index vertex : moved) {
        moving_[vertex] = make_swept_box(motion.t0[vertex], motion.t1[vertex]);
        for (Index k = vertex_cluster_begin_[vertex]; k < vertex_cluster_begin_[vertex + 1]; ++k) {
            const Index cluster = vertex_clusters_[k];
            boxes_made_[cluster] = 0;
            for (Index node = clusters_[cluster].node; node != kNoIndex && !dirty_[node]; node = parents_[node]) dirty_[node] = 1;
        }
    }
    for (std::size_t i = nodes_.size(); i-- > 0;) {
        if (!dirty_[i]) continue;
        dirty_[i] = 0;
        refit_node(nodes_[i]);
    }
}

BoxTree::FeatureBoxes BoxTree::feature_boxes(Index cluster) {
    if (!boxes_made_[cluster]) make_feature_boxes(cluster);
    const Cluster& c = clusters_[cluster];
    const auto part = [](const std::vector<SweptBox>& boxes, Range range) {
        return std::span<const SweptBox>(boxes).subspan(range.begin, range.size());
    };
    return {part(triangle_boxes_, c.triangles), part(edge_boxes_, c.edges), part(vertex_boxes_, c.vertices)};
}

void BoxTree::make_feature_boxes(Index cluster) {
    const Cluster& c = clusters_[cluster];
    for (Index k = c.vertices.begin; k < c.vertices.end; ++k) vertex_boxes_[k] = moving_[vertex_ids_[k]];
    for (Index k = c.edges.begin; k < c.edges.end; ++k) {
        const Edge& edge = topology_->edges[edge_ids_[k]];
        edge_boxes_[k] = moving_[edge[0]];
        edge_boxes_[k].add(moving_[edge[1]]);
    }
    for (Index k = c.triangles.begin; k < c.triangles.end; ++k) {
        const Triangle& t = topology_->triangles[triangle_ids_[k]];
        triangle_boxes_[k] = moving_[t[0]];
        triangle_boxes_[k].add(moving_[t[1]]);
        triangle_boxes_[k].add(moving_[t[2]]);
    }
    boxes_made_[cluster] = 1;
}

} // namespace trocar::collision
