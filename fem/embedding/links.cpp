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
    frames.frame.resize(links.frame_nodes.size());
    frames.node.resize(links.node_rest.size());
    for (std::size_t node = 0; node < node_position.size(); ++node)
        for (int axis = 0; axis < 3; ++axis) {
            frames.node[node].x[axis] = node_position[node][axis];
            frames.node[node].v[axis] = node_position[node][axis] - links.node_rest[node][axis];
        }
    return turn_link_frames(links, frames.node, frames.frame, frames.threads);
}

void place_vertices(const RigidLinks& links, const LinkFrames& frames, std::span<const Vec3> rest, std::span<Vec3> out) noexcept {
    assert(rest.size() == links.vertex_count() && out.size() == links.vertex_count());
    assert(rest.data() != out.data() || rest.empty());
    assert(frames.frame.size() == links.frame_nodes.size());
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
    return kVertex * links.vertex_count() + kFrame * links.frame_nodes.size() +
           (2 * sizeof(Vec3) + sizeof(NodeRecord)) * links.node_rest.size();
}

LinkJacobian link_jacobian(const RigidLinks& links, Index vertex, std::span<const Vec3> node_position) noexcept {
    LinkJacobian jacobian;
    const Index frame = links.vertex_frame[vertex];
    if (frame == kNoIndex) return jacobian;
    const Triangle& nodes = links.frame_nodes[frame];
    const LinkTriangle triangle = link_triangle(nodes, node_position);
    Mat3 axes;
    const bool turns = find_axes(triangle, axes);
    const double blend = links.vertex_blend[vertex];
    for (std::size_t i = 0; i < 3; ++i) {
        jacobian.node[i] = nodes[i];
        jacobian.block[i] = blend * links.vertex_weight[vertex][i] * Mat3::Identity();
    }
    if (!turns) return jacobian;
    const Mat3 lever = skew(axes * links.vertex_projection[vertex]);
    const TurnRates rates = find_turn_rates(triangle, axes);
    for (int i = 0; i < 3; ++i) jacobian.block[i] -= blend * lever * rates.node[i]; // omega x R = -[R]x omega
    return jacobian;
}

LinkForces spread_link_force(const RigidLinks& links, Index vertex, std::span<const Vec3> node_position, const Vec3& force) noexcept {
    LinkForces spread;
    const LinkJacobian jacobian = link_jacobian(links, vertex, node_position);
    for (int i = 0; i < 3; ++i) {
        spread.node[i] = jacobian.node[i];
        spread.force[i] = jacobian.block[i].transpose() * force;
    }
    return spread;
}

} // namespace trocar::fem
