// Vertices that follow the affine image of a tetrahedron.
#include "fem/embedding/links.hpp"

#include <cmath>

namespace trocar::fem {

namespace {

/// [-]; six volumes of a tetrahedron over the cube of its longest edge, below which its coordinates are rounding; and a weight on a node with which a place
/// lies too far outside of it.
constexpr double kFlat = 1e-4, kFarWeight = 8.0;
/// Smallest coordinate of a vertex that follows a tetrahedron: farther off, its coordinates would make much of what the nodes do.
constexpr double kFarthest = -2.0;

void corners_of(std::span<const Tet> tets, std::span<const Vec3> at, Index tet, Vec3 (&x)[4]) noexcept {
    for (std::size_t k = 0; k < 4; ++k) x[k] = at[tets[tet][k]];
}

} // namespace

bool find_affine(const Vec3 (&x)[4], const Vec3& p, double (&weight)[4]) noexcept {
    const Vec3 a = x[1] - x[0], b = x[2] - x[0], c = x[3] - x[0], d = p - x[0];
    const Vec3 bc = b.cross(c);
    const double volume = a.dot(bc);
    const double longest = std::max({a.squaredNorm(), b.squaredNorm(), c.squaredNorm(), (x[2] - x[1]).squaredNorm(),
                                     (x[3] - x[1]).squaredNorm(), (x[3] - x[2]).squaredNorm()});
    if (!(std::abs(volume) > kFlat * longest * std::sqrt(longest))) return false;
    const double w1 = d.dot(bc) / volume, w2 = d.dot(c.cross(a)) / volume, w3 = d.dot(a.cross(b)) / volume;
    const double w0 = 1.0 - (w1 + w2 + w3);
    if (!(std::max({std::abs(w0), std::abs(w1), std::abs(w2), std::abs(w3)}) <= kFarWeight)) return false;
    weight[0] = w0, weight[1] = w1, weight[2] = w2, weight[3] = w3;
    return true;
}

NodeTets::NodeTets(std::span<const Tet> tets, std::size_t node_count) : begin(node_count + 1, 0), tet(4 * tets.size()) {
    for (const Tet& t : tets)
        for (const Index node : t) ++begin[node + 1];
    for (std::size_t n = 0; n < node_count; ++n) begin[n + 1] += begin[n];
    std::vector<Index> next(begin.begin(), begin.end() - 1);
    for (Index t = 0; t < tets.size(); ++t)
        for (const Index node : tets[t]) tet[next[node]++] = t;
}

TetPlace find_tet_beneath(std::span<const Tet> tets, std::span<const Vec3> node_position, const NodeTets& around, std::span<const Index> nodes,
                          const Vec3& p) noexcept {
    TetPlace best;
    for (const Index node : nodes)
        for (const Index t : around.of(node)) {
            TetPlace there{t};
            Vec3 x[4];
            corners_of(tets, node_position, t, x);
            if (!find_affine(x, p, there.weight)) continue;
            if (best.tet == kNoIndex || there.least() > best.least() || (there.least() == best.least() && t < best.tet)) best = there;
        }
    return best;
}

std::size_t follow_tets(RigidLinks& links, std::span<const Tet> tets, std::span<const Vec3> vertices, std::span<const Index> which) {
    const NodeTets around(tets, links.node_rest.size());
    std::size_t count = 0;
    for (const Index v : which) {
        if (links.vertex_frame[v] == kNoIndex) continue;
        TetPlace best, next = find_tet_beneath(tets, links.node_rest, around, links.nodes_of(links.vertex_frame[v]), vertices[v]);
        while (next.tet != best.tet) { // as far as a tetrahedron whose neighbours are no nearer
            best = next;
            next = find_tet_beneath(tets, links.node_rest, around, tets[best.tet], vertices[v]);
        }
        if (best.tet == kNoIndex || best.least() < kFarthest) continue;
        links.vertex_frame[v] = static_cast<Index>(links.frame_count());
        links.affine_nodes.push_back(tets[best.tet]);
        links.affine_weight.push_back(std::to_array(best.weight));
        links.vertex_weight[v] = {1.0, 0.0, 0.0};
        links.vertex_projection[v].setZero();
        ++count;
    }
    if (count == 0) return 0;
    links.max_length = 0.0;
    links.longest = kNoIndex;
    for (Index v = 0; v < links.vertex_count(); ++v) {
        if (links.vertex_frame[v] == kNoIndex || links.is_affine(links.vertex_frame[v])) continue;
        const double length = links.vertex_projection[v].norm();
        if (length > links.max_length || links.longest == kNoIndex) links.max_length = length, links.longest = v;
    }
    return count;
}

} // namespace trocar::fem
