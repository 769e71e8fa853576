#include "spheretree/update/deforming_tree.hpp"

#include "spheretree/bounding.hpp"

#include <algorithm>
#include <limits>
#include <numeric>

namespace trocar::spheretree {

namespace {

/// Sine below which three nodes do not say how a sphere turns: it is not turned then, and grows instead.
constexpr double kThin = 1e-3;

/// Three nodes far apart: the one farthest from the first, the one farthest from that, the one farthest off their line.
Triangle find_turners(std::span<const Index> nodes, std::span<const Vec3> rest) {
    constexpr Triangle kNone{kNoIndex, kNoIndex, kNoIndex};
    if (nodes.size() < 3) return kNone;
    const auto farthest = [&](auto&& distance) { // the first of equals
        Index best = nodes.front();
        for (const Index n : nodes)
            if (distance(rest[n]) > distance(rest[best])) best = n;
        return best;
    };
    const Index a = farthest([&](const Vec3& p) { return (p - rest[nodes.front()]).squaredNorm(); });
    const Index b = farthest([&](const Vec3& p) { return (p - rest[a]).squaredNorm(); });
    const Vec3 line = rest[b] - rest[a];
    const auto off_line = [&](const Vec3& p) { return line.cross(p - rest[a]).squaredNorm(); };
    const Index c = farthest(off_line);
    const double length_sq = line.squaredNorm();
    return off_line(rest[c]) > kThin * kThin * length_sq * length_sq ? Triangle{a, b, c} : kNone;
}

/// Orthonormal axes of three points; false where they have collapsed.
bool find_axes(const Vec3& a, const Vec3& b, const Vec3& c, Mat3& axes) noexcept {
    const Vec3 e = b - a, f = c - a, n = e.cross(f);
    const double e_sq = e.squaredNorm(), n_sq = n.squaredNorm();
    if (!(n_sq > kThin * kThin * kThin * kThin * e_sq * f.squaredNorm())) return false;
    axes.col(0) = e / std::sqrt(e_sq);
    axes.col(1) = n / std::sqrt(n_sq);
    axes.col(2) = axes.col(0).cross(axes.col(1));
    return true;
}

Mat3 find_turn(const DeformingTree& tree, Index sphere, std::span<const Vec3> position) noexcept {
    const Triangle& t = tree.turners[sphere];
    Mat3 rest, now;
    if (t[0] == kNoIndex || !find_axes(tree.node_rest[t[0]], tree.node_rest[t[1]], tree.node_rest[t[2]], rest) ||
        !find_axes(position[t[0]], position[t[1]], position[t[2]], now))
        return Mat3::Identity();
    return now * rest.transpose();
}

/// Largest stretch of the difference of two rotations: it has two equal singular values and a zero.
double difference(const Mat3& a, const Mat3& b) noexcept { return std::sqrt(0.5 * (a - b).squaredNorm()); }

Vec3 mean_of(std::span<const Index> nodes, std::span<const Vec3> position) noexcept {
    Vec3 sum = Vec3::Zero();
    for (const Index n : nodes) sum += position[n];
    return sum / static_cast<double>(nodes.size());
}

std::span<const Index> nodes_of(const DeformingTree& tree, Index frame) noexcept {
    const std::size_t triangles = tree.frame_nodes.size();
    return frame < triangles ? std::span<const Index>(tree.frame_nodes[frame]) : std::span<const Index>(tree.affine_nodes[frame - triangles]);
}

/// A corner of a piece is p = sum b_k v_k of the vertices of its triangle, b_k >= 0 with the sum 1, and |p - c| <= r at rest. With
/// T x = c' + turn (x - c) it goes to p' = T p + sum b_k (v_k' - T v_k), so |p' - c'| <= r + max |v_k' - T v_k| wherever the v_k lie.
/// A vertex that stands still: |v - T v| <= |c' - c| + |turn - I| |v - c|, and v may lie outside of the sphere: `stands` bounds |v - c|.
/// One that moves by a share s of its frame's: v' - T v = (1 - s) (v - T v) + s (m' - T v), at most the larger of the two bounds.
Sphere deform_conservatively(const DeformingTree& tree, Index sphere, const NodePose& pose) noexcept {
    const Sphere& rest = tree.tree.spheres[sphere];
    const std::span<const Index> near(tree.near.data() + tree.near_begin[sphere], tree.near_begin[sphere + 1] - tree.near_begin[sphere]);
    const Mat3 turn = find_turn(tree, sphere, pose.position);
    Sphere out{mean_of(near, pose.position) + turn * (rest.centre - mean_of(near, tree.node_rest)), rest.radius};
    double grow = 0.0;
    for (Index k = tree.beneath_begin[sphere]; k < tree.beneath_begin[sphere + 1]; ++k) {
        const DeformingTree::Beneath& carried = tree.beneath[k];
        double node_sq = 0.0;
        for (const Index q : nodes_of(tree, carried.frame))
            node_sq = std::max(node_sq, (pose.position[q] - out.centre - turn * (tree.node_rest[q] - rest.centre)).squaredNorm());
        if (carried.frame >= tree.frame_nodes.size()) {
            grow = std::max(grow, tree.affine_reach[carried.frame - tree.frame_nodes.size()] * std::sqrt(node_sq));
            continue;
        }
        const Mat3 now = tree.frame_rest[carried.frame] + pose.turn[carried.frame];
        grow = std::max(grow, std::sqrt(node_sq) + carried.reach * difference(now, turn * tree.frame_rest[carried.frame]));
    }
    if (tree.stands[sphere] > 0.0)
        grow = std::max(grow, (out.centre - rest.centre).norm() + tree.stands[sphere] * difference(turn, Mat3::Identity()));
    if (!is_finite(out.centre) || !std::isfinite(grow)) return {};
    out.radius = (rest.radius + grow) * kRoundOut + 1e-12 * out.centre.cwiseAbs().maxCoeff();
    return out;
}

Sphere deform_as_the_paper(const DeformingTree& tree, Index sphere, const NodePose& pose) noexcept {
    const Sphere& rest = tree.tree.spheres[sphere];
    const std::span<const Index> near(tree.near.data() + tree.near_begin[sphere], tree.near_begin[sphere + 1] - tree.near_begin[sphere]);
    const Vec3 centre = rest.centre + (mean_of(near, pose.position) - mean_of(near, tree.node_rest));
    double stretch = -1.0;
    for (const Index q : near) {
        const double before = (rest.centre - tree.node_rest[q]).norm();
        if (before > 1e-9 * rest.radius) stretch = std::max(stretch, (centre - pose.position[q]).norm() / before);
    }
    if (!is_finite(centre)) return {};
    return {centre, stretch < 0.0 ? rest.radius : rest.radius * stretch};
}

/// The `count` nodes nearest to a place, ascending by distance; ties by id.
void add_nearest(const Vec3& place, std::span<const Vec3> nodes, std::size_t count, std::vector<std::pair<double, Index>>& scratch,
                 std::vector<Index>& out) {
    scratch.clear();
    for (Index n = 0; n < nodes.size(); ++n) scratch.emplace_back((nodes[n] - place).squaredNorm(), n);
    count = std::min(count, scratch.size());
    std::partial_sort(scratch.begin(), scratch.begin() + static_cast<std::ptrdiff_t>(count), scratch.end());
    for (std::size_t k = 0; k < count; ++k) out.push_back(scratch[k].second);
}

/// Frames beneath one sphere, ascending, each with its longest reach.
/// stands  as DeformingTree's, 0 before
void add_frames(const DeformingTree& out, Index sphere, const TriMesh& surface, const SurfaceLinks& links, std::vector<double>& reach,
                std::vector<DeformingTree::Beneath>& beneath, double& stands) {
    const Sphere& rest = out.tree.spheres[sphere];
    std::vector<Index> frames;
    for (const Index triangle : out.tree.items_of(sphere))
        for (const Index v : surface.triangles[triangle]) {
            const Index frame = links.vertex_frame[v];
            if (frame == kNoIndex || links.vertex_blend[v] < 1.0)
                stands = std::max({stands, std::numeric_limits<double>::min(), rest.radius, (surface.vertices[v] - rest.centre).norm()});
            if (frame == kNoIndex) continue;
            if (reach[frame] < 0.0) frames.push_back(frame);
            reach[frame] = std::max(reach[frame], links.vertex_projection[v].norm());
        }
    std::sort(frames.begin(), frames.end());
    for (const Index frame : frames) {
        beneath.push_back({frame, reach[frame]});
        reach[frame] = -1.0;
    }
}

} // namespace

DeformingTree make_deforming_tree(SphereTree tree, const TriMesh& surface, const SurfaceLinks& links, std::span<const unsigned> nearest) {
    DeformingTree out;
    out.tree = std::move(tree);
    out.frame_rest.assign(links.frame_rest.begin(), links.frame_rest.end());
    out.frame_nodes.assign(links.frame_nodes.begin(), links.frame_nodes.end());
    out.node_rest.assign(links.node_rest.begin(), links.node_rest.end());
    out.affine_nodes.assign(links.affine_nodes.begin(), links.affine_nodes.end());
    for (const std::array<double, 4>& w : links.affine_weight)
        out.affine_reach.push_back(std::abs(w[0]) + std::abs(w[1]) + std::abs(w[2]) + std::abs(w[3]));
    out.near_begin.push_back(0);
    out.beneath_begin.push_back(0);
    std::vector<Index> host_nodes; // nodes that any of the surface is embedded in
    for (const Triangle& nodes : out.frame_nodes) host_nodes.insert(host_nodes.end(), nodes.begin(), nodes.end());
    for (const Tet& nodes : out.affine_nodes) host_nodes.insert(host_nodes.end(), nodes.begin(), nodes.end());
    std::sort(host_nodes.begin(), host_nodes.end());
    host_nodes.erase(std::unique(host_nodes.begin(), host_nodes.end()), host_nodes.end());
    std::vector<Vec3> host_node_rest;
    for (const Index n : host_nodes) host_node_rest.push_back(out.node_rest[n]);
    std::vector<std::pair<double, Index>> by_distance;
    std::vector<double> reach(out.frame_nodes.size() + out.affine_nodes.size(), -1.0);
    std::vector<Index> nodes;
    for (Index s = 0; s < out.tree.sphere_count(); ++s) {
        const std::size_t level = std::min<std::size_t>(out.tree.level[s], nearest.size() - 1);
        const std::size_t first = out.near.size();
        add_nearest(out.tree.spheres[s].centre, host_node_rest, nearest[level], by_distance, out.near);
        for (std::size_t k = first; k < out.near.size(); ++k) out.near[k] = host_nodes[out.near[k]];
        out.near_begin.push_back(static_cast<Index>(out.near.size()));
        out.stands.push_back(0.0);
        const std::size_t begin = out.beneath.size();
        add_frames(out, s, surface, links, reach, out.beneath, out.stands.back());
        out.beneath_begin.push_back(static_cast<Index>(out.beneath.size()));
        nodes.clear();
        for (std::size_t k = begin; k < out.beneath.size(); ++k) {
            const std::span<const Index> on = nodes_of(out, out.beneath[k].frame);
            nodes.insert(nodes.end(), on.begin(), on.end());
        }
        out.turners.push_back(find_turners(nodes, out.node_rest));
    }
    return out;
}

Sphere deform_sphere(const DeformingTree& tree, Index sphere, const NodePose& pose, SphereUpdate update) noexcept {
    const Sphere& rest = tree.tree.spheres[sphere];
    if (rest.radius < 0.0 || tree.near_begin[sphere] == tree.near_begin[sphere + 1]) return rest; // embedded in no frame
    return update == SphereUpdate::Conservative ? deform_conservatively(tree, sphere, pose) : deform_as_the_paper(tree, sphere, pose);
}

void DeformingSpheres::begin(const DeformingTree& tree, SphereUpdate update, const NodePose& pose_t1, const NodePose& pose_t0,
                             double reach) {
    if (tree_ != &tree || known_.size() != tree.tree.sphere_count()) {
        spheres_.assign(tree.tree.sphere_count(), Sphere{});
        known_.assign(tree.tree.sphere_count(), 0);
        step_ = 0;
    }
    tree_ = &tree;
    update_ = update;
    t0_ = pose_t0;
    t1_ = pose_t1;
    reach_ = reach;
    updated_ = 0;
    if (++step_ == 0) { // the counter wrapped round
        std::fill(known_.begin(), known_.end(), 0u);
        step_ = 1;
    }
}

void DeformingSpheres::ensure(Index first, Index count) noexcept {
    for (Index s = first; s < first + count; ++s) {
        if (known_[s] == step_) continue;
        known_[s] = step_;
        ++updated_;
        spheres_[s] = deform_sphere(*tree_, s, t1_, update_);
        if (!t0_.position.empty()) spheres_[s] = enclose_two(deform_sphere(*tree_, s, t0_, update_), spheres_[s]);
        if (spheres_[s].radius >= 0.0) spheres_[s].radius += reach_;
    }
}

} // namespace trocar::spheretree
