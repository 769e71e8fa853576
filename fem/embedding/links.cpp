#include "fem/embedding/links.hpp"

#include "fem/embedding/link_frame.hpp"
#include "fem/embedding/link_kernels.hpp"

#include <cassert>

namespace trocar::fem {

namespace {

LinkTriangle link_triangle(const Triangle& nodes, std::span<const Vec3> position) noexcept {
    return {position[nodes[0]], position[nodes[1]], position[nodes[2]]};
}

/// Rotation of the frame per node displacement: omega = sum_i w[i] dq_i. With b = n x e: omega . n = de.b/|e|,
/// omega . b = -de.n/|e|, omega . e = (|e| df.n - (f.e) de.n)/|e x f|; e, f the edges, unit where they stand for axes.
struct TurnRates {
    Mat3 node[3];
};

TurnRates find_turn_rates(const LinkTriangle& t, const Mat3& axes) noexcept {
    const Vec3 e = t.q1 - t.q0, f = t.q2 - t.q0;
    const Vec3 n_axis = axes.col(0), e_axis = axes.col(1), b_axis = -axes.col(2);
    const double length = e.norm(), area = e.cross(f).norm();
    TurnRates rates;
    rates.node[1] =
        (n_axis * b_axis.transpose() - b_axis * n_axis.transpose()) / length - e_axis * n_axis.transpose() * (f.dot(e_axis) / area);
    rates.node[2] = e_axis * n_axis.transpose() * (length / area);
    rates.node[0] = -(rates.node[1] + rates.node[2]);
    return rates;
}

Mat3 skew(const Vec3& v) noexcept {
    Mat3 m;
    m << 0, -v[2], v[1], v[2], 0, -v[0], -v[1], v[0], 0;
    return m;
}

} // namespace

EmbeddedUpdateReport turn_frames(const RigidLinks& links, std::span<const Vec3> node_position, LinkFrames& frames) noexcept {
    assert(node_position.size() == links.node_rest.size());
    frames.frame.resize(links.frame_count());
    frames.node.resize(links.node_rest.size());
    for (std::size_t node = 0; node < node_position.size(); ++node)
        for (int axis = 0; axis < 3; ++axis) {
            frames.node[node].x[axis] = node_position[node][axis];
            frames.node[node].v[axis] = node_position[node][axis] - links.node_rest[node][axis];
        }
    const std::size_t triangles = links.frame_nodes.size();
    for (std::size_t k = 0; k < links.affine_nodes.size(); ++k)
        for (int axis = 0; axis < 3; ++axis) {
            double sum = 0.0;
            for (std::size_t i = 0; i < 4; ++i) sum += links.affine_weight[k][i] * frames.node[links.affine_nodes[k][i]].v[axis];
            frames.frame[triangles + k].displacement[0][axis] = sum;
        }
    return turn_link_frames(links, frames.node, std::span(frames.frame).first(triangles), frames.threads);
}

void place_vertices(const RigidLinks& links, const LinkFrames& frames, std::span<const Vec3> rest, std::span<Vec3> out) noexcept {
    assert(rest.size() == links.vertex_count() && out.size() == links.vertex_count());
    assert(rest.data() != out.data() || rest.empty());
    assert(frames.frame.size() == links.frame_count());
    move_vertices(links, frames, rest, out);
}

EmbeddedUpdateReport update_embedded_surface(const RigidLinks& links, std::span<const Vec3> node_position, std::span<const Vec3> rest, LinkFrames& frames,
                  std::span<Vec3> out) noexcept {
    const EmbeddedUpdateReport report = turn_frames(links, node_position, frames);
    place_vertices(links, frames, rest, out);
    return report;
}

std::size_t embedded_update_bytes(const RigidLinks& links) noexcept {
    constexpr std::size_t kVertex = sizeof(Index) + sizeof(std::array<double, 3>) + 3 * sizeof(Vec3) + sizeof(double);
    constexpr std::size_t kFrame = sizeof(Triangle) + sizeof(Mat3) + 2 * sizeof(LinkFrame);
    constexpr std::size_t kAffine = sizeof(Tet) + sizeof(std::array<double, 4>) + 2 * sizeof(LinkFrame);
    return kVertex * links.vertex_count() + kFrame * links.frame_nodes.size() + kAffine * links.affine_nodes.size() +
           (2 * sizeof(Vec3) + sizeof(NodeRecord)) * links.node_rest.size();
}

LinkJacobian link_jacobian(const RigidLinks& links, Index vertex, std::span<const Vec3> node_position) noexcept {
    LinkJacobian jacobian;
    const Index frame = links.vertex_frame[vertex];
    if (frame == kNoIndex) return jacobian;
    const double blend = links.vertex_blend[vertex];
    const std::span<const Index> on = links.nodes_of(frame);
    for (std::size_t i = 0; i < on.size(); ++i) {
        jacobian.node[i] = on[i];
        jacobian.block[i] = blend * links.weights_of(vertex)[i] * Mat3::Identity();
    }
    if (links.is_affine(frame)) return jacobian;
    const Triangle& nodes = links.frame_nodes[frame];
    const LinkTriangle triangle = link_triangle(nodes, node_position);
    Mat3 axes;
    if (!find_axes(triangle, axes)) return jacobian;
    const Mat3 lever = skew(axes * links.vertex_projection[vertex]);
    const TurnRates rates = find_turn_rates(triangle, axes);
    for (int i = 0; i < 3; ++i) jacobian.block[i] -= blend * lever * rates.node[i]; // omega x R = -[R]x omega
    return jacobian;
}

LinkForces spread_link_force(const RigidLinks& links, Index vertex, std::span<const Vec3> node_position, const Vec3& force) noexcept {
    LinkForces spread;
    const LinkJacobian jacobian = link_jacobian(links, vertex, node_position);
    for (std::size_t i = 0; i < kMostLinkNodes; ++i) {
        spread.node[i] = jacobian.node[i];
        spread.force[i] = jacobian.block[i].transpose() * force;
    }
    return spread;
}

LinkForces spread_hold(const RigidLinks& links, Index vertex, std::span<const Vec3> node_position, const Vec3& force) noexcept {
    const Index frame = links.vertex_frame[vertex];
    if (frame == kNoIndex || !links.is_affine(frame)) return spread_link_force(links, vertex, node_position, force);
    LinkForces spread;
    const std::span<const Index> nodes = links.nodes_of(frame);
    const std::span<const double> weights = links.weights_of(vertex);
    double sum = 0.0; // 1 at least: the weights sum to one
    for (const double weight : weights) sum += std::max(0.0, weight);
    for (std::size_t i = 0; i < kMostLinkNodes; ++i) {
        spread.node[i] = nodes[i];
        spread.force[i] = links.vertex_blend[vertex] * std::max(0.0, weights[i]) / sum * force;
    }
    return spread;
}

} // namespace trocar::fem
