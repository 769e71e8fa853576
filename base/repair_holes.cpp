// Closing border loops. A loop of moderate length gets the triangulation of least area, found by dynamic programming over its
// chords (Barequet & Sharir 1995, Liepa 2003); longer ones a fan around their centre.
#include "base/predicates.hpp"
#include "base/repair_steps.hpp"
#include "base/topology.hpp"

#include <algorithm>
#include <set>

namespace seldinger::repairs {
namespace {

constexpr std::size_t kMaxOptimalLoop = 320; // cost grows with the cube: about 6 million triangles to weigh
constexpr double kShapeWeight = 0.01;        // of squared edge lengths beside area: among equal areas the rounder triangles

using Loop = std::vector<Index>; // vertices in the direction in which new triangles run
using Edge = std::array<Index, 2>;

Edge edge_of(Index a, Index b) { return {std::min(a, b), std::max(a, b)}; }

/// A border edge as the missing triangle would run through it, with the fans it joins at both ends.
struct HoleEdge {
    Index from, from_fan, to, to_fan;
};

std::vector<HoleEdge> find_hole_edges(const TriMesh& mesh) {
    const auto fans = corner_fans(mesh.triangles, mesh.vertices.size(), false);
    std::vector<HoleEdge> edges;
    for_each_edge(sorted_edge_uses(mesh.triangles), [&](std::span<const EdgeUse> uses) {
        if (uses.size() != 1) return;
        const Triangle& t = mesh.triangles[uses[0].triangle];
        const std::size_t k = uses[0].corner, next = (k + 1) % 3;
        edges.push_back({t[next], fans[uses[0].triangle][next], t[k], fans[uses[0].triangle][k]});
    });
    std::sort(edges.begin(), edges.end(),
              [](const HoleEdge& a, const HoleEdge& b) { return a.from != b.from ? a.from < b.from : a.from_fan < b.from_fan; });
    return edges;
}

/// Where several fans meet at a vertex, a hole lies between one fan and the next: going on along the next one makes the
/// vertex whole again.
std::vector<Loop> trace_loops(const std::vector<HoleEdge>& edges) {
    const auto next_of = [&edges](const HoleEdge& edge) {
        const auto at_vertex = [](const HoleEdge& e, Index v) { return e.from < v; };
        const auto begin = std::lower_bound(edges.begin(), edges.end(), edge.to, at_vertex);
        auto end = begin;
        while (end != edges.end() && end->from == edge.to) ++end;
        const auto after = std::find_if(begin, end, [&](const HoleEdge& e) { return e.from_fan > edge.to_fan; });
        return static_cast<std::size_t>((after == end ? begin : after) - edges.begin());
    };
    std::vector<Loop> loops;
    std::vector<bool> done(edges.size(), false);
    for (std::size_t start = 0; start < edges.size(); ++start) {
        if (done[start]) continue;
        Loop loop;
        for (std::size_t e = start; !done[e]; e = next_of(edges[e])) {
            done[e] = true;
            loop.push_back(edges[e].from);
        }
        loops.push_back(loop);
    }
    return loops;
}

/// Loops that visit no vertex twice. Where one would, the vertex only holds parts together that belong apart: it is split.
std::vector<Loop> find_simple_loops(TriMesh& mesh, RepairStep& step) {
    for (;;) {
        const std::vector<Loop> loops = trace_loops(find_hole_edges(mesh));
        std::vector<bool> split(mesh.vertices.size(), false);
        bool all_simple = true;
        for (Loop loop : loops) {
            std::sort(loop.begin(), loop.end());
            for (auto twice = std::adjacent_find(loop.begin(), loop.end()); twice != loop.end();
                 twice = std::adjacent_find(twice + 1, loop.end())) {
                split[*twice] = true;
                all_simple = false;
            }
        }
        if (all_simple) return loops;
        step.vertices_split += split_vertices(mesh, split, false);
    }
}

class LoopFiller {
public:
    LoopFiller(TriMesh& mesh, const Loop& loop, std::set<Edge>& edges) : mesh_(mesh), loop_(loop), edges_(edges), n_(loop.size()) {}

    void fill() {
        if (n_ <= kMaxOptimalLoop && find_least_area())
            add_span(0, n_ - 1);
        else
            add_fan();
    }

private:
    [[nodiscard]] double& cost(std::size_t i, std::size_t k) { return cost_[i * n_ + k]; }
    [[nodiscard]] double weigh(std::size_t i, std::size_t j, std::size_t k) const {
        const Vec3 &a = mesh_.vertices[loop_[i]], &b = mesh_.vertices[loop_[j]], &c = mesh_.vertices[loop_[k]];
        const double doubled = (b - a).cross(c - a).norm();
        const double edges_sq = (b - a).squaredNorm() + (c - b).squaredNorm() + (a - c).squaredNorm();
        if (doubled < 1e-9 * edges_sq && are_collinear(a, b, c)) return std::numeric_limits<double>::infinity();
        return 0.5 * doubled + kShapeWeight * edges_sq;
    }
    /// cost(i, k): least weight of the triangles between the chord i-k and the loop from i to k.
    bool find_least_area() {
        constexpr double kForbidden = std::numeric_limits<double>::infinity();
        cost_.assign(n_ * n_, 0.0);
        apex_.assign(n_ * n_, 0);
        for (std::size_t length = 2; length < n_; ++length)
            for (std::size_t i = 0; i + length < n_; ++i) {
                const std::size_t k = i + length;
                cost(i, k) = kForbidden;
                const bool is_loop_edge = i == 0 && k == n_ - 1;
                if (!is_loop_edge && edges_.contains(edge_of(loop_[i], loop_[k]))) continue; // would be a third triangle there
                for (std::size_t j = i + 1; j < k; ++j) {
                    const double sides = cost(i, j) + cost(j, k);
                    if (!(sides < cost(i, k))) continue;
                    const double total = sides + weigh(i, j, k);
                    if (total < cost(i, k)) cost(i, k) = total, apex_[i * n_ + k] = static_cast<Index>(j);
                }
            }
        return cost(0, n_ - 1) < kForbidden;
    }
    void add(Index a, Index b, Index c) {
        mesh_.triangles.push_back({a, b, c});
        edges_.insert({edge_of(a, b), edge_of(b, c), edge_of(c, a)});
    }
    void add_span(std::size_t first, std::size_t last) {
        std::vector<std::array<std::size_t, 2>> open{{first, last}};
        while (!open.empty()) {
            const auto [i, k] = open.back();
            open.pop_back();
            if (k < i + 2) continue;
            const std::size_t j = apex_[i * n_ + k];
            add(loop_[i], loop_[j], loop_[k]);
            open.push_back({i, j});
            open.push_back({j, k});
        }
    }
    void add_fan() {
        Vec3 sum = Vec3::Zero();
        double length = 0.0;
        for (std::size_t i = 0; i < n_; ++i) { // centre of the border line, not of its vertices, which may crowd
            const Vec3 &a = mesh_.vertices[loop_[i]], &b = mesh_.vertices[loop_[(i + 1) % n_]];
            sum += (b - a).norm() * 0.5 * (a + b);
            length += (b - a).norm();
        }
        const auto centre = static_cast<Index>(mesh_.vertices.size());
        mesh_.vertices.push_back(length > 0.0 ? Vec3(sum / length) : mesh_.vertices[loop_[0]]);
        for (std::size_t i = 0; i < n_; ++i) add(loop_[i], loop_[(i + 1) % n_], centre);
    }

    TriMesh& mesh_;
    const Loop& loop_;
    std::set<Edge>& edges_;
    std::size_t n_;
    std::vector<double> cost_;
    std::vector<Index> apex_;
};

/// A triangle with three open edges closes onto itself and bounds nothing.
std::size_t drop_lone_triangles(TriMesh& mesh) {
    const auto neighbours = triangle_neighbours(mesh.triangles);
    std::vector<bool> keep(mesh.triangles.size());
    for (std::size_t t = 0; t < keep.size(); ++t)
        keep[t] = !std::all_of(neighbours[t].begin(), neighbours[t].end(), [](Index n) { return n == kNoIndex; });
    return keep_triangles(mesh, keep);
}

} // namespace

Result<RepairStep> fill_holes(TriMesh& mesh) {
    if (const Result<void> check = check_edge_manifold(mesh, Repair::FillHoles); !check) return check.error();
    RepairStep step;
    const Result<std::size_t> flipped = orient_consistently(mesh); // a hole's edges need a direction
    if (!flipped) return flipped.error();
    step.triangles_flipped = *flipped;
    step.triangles_removed = drop_lone_triangles(mesh);
    if (mesh.triangles.empty()) return Error{ErrorCode::BadMesh, "no two triangles share an edge; weld before fill_holes helps"};
    const std::vector<Loop> loops = find_simple_loops(mesh, step);
    const std::size_t before = mesh.triangles.size();
    const auto known = unique_edges(mesh.triangles);
    std::set<Edge> edges(known.begin(), known.end());
    for (const Loop& loop : loops) LoopFiller(mesh, loop, edges).fill();
    step.holes_filled = loops.size();
    step.triangles_added = mesh.triangles.size() - before;
    return step;
}

} // namespace seldinger::repairs
