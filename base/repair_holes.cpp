// Closing border loops. A loop of moderate length gets the triangulation of least area, found by dynamic programming over its
// chords (Barequet & Sharir 1995, Liepa 2003); longer ones a fan around their centre. A triangulation that crosses the surface is
// found anew without the triangles that do. Cracks of no width, which only triangles without area close, are sewn up.
#include "base/predicates.hpp"
#include "base/repair_steps.hpp"
#include "base/self_intersection.hpp"
#include "base/topology.hpp"
#include "base/triangle_tree.hpp"

#include <algorithm>
#include <set>

namespace trocar::repairs {
namespace {

constexpr std::size_t kMaxOptimalLoop = 800;  // cost grows with the cube: about 85 million pairs of chords to weigh
constexpr std::size_t kMaxSearchedLoop = 400; // of whose chords all are tried: at most 80 thousand
constexpr int kMaxFillings = 40;              // of the same loops, each without the triangles that crossed before
constexpr double kMostWeighed = 1e9;          // triangles in all fillings together, about: seconds; loops beyond it get fans
constexpr double kBeside = 0.1;               // of the way to a vertex of the border
constexpr double kRoundness = 0.01;         // of squared edge lengths beside area: among equal areas the rounder triangles

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

/// What a patch may not contain: edges that two triangles have already or that pierce one, and triangles that were seen to cross one.
struct Taken {
    std::span<const Edge> old_edges; // ascending
    std::set<Edge> new_edges;
    const std::set<Edge>& piercing;
    const std::set<Triangle>& crossing; // corners ascending

    [[nodiscard]] bool has(const Edge& edge) const {
        return new_edges.contains(edge) || piercing.contains(edge) || std::binary_search(old_edges.begin(), old_edges.end(), edge);
    }
};

Triangle sorted(Triangle t) {
    std::sort(t.begin(), t.end());
    return t;
}

class LoopFiller {
public:
    LoopFiller(TriMesh& mesh, const Loop& loop, const Taken& taken) : mesh_(mesh), loop_(loop), taken_(taken), n_(loop.size()) {}

    /// The triangles that close the loop; a fan brings a vertex of its own into the mesh.
    /// weighs  find the least area, where there is any
    [[nodiscard]] std::vector<Triangle> fill(bool weighs) {
        if (weighs && find_least_area()) return list_patch();
        return make_fan();
    }

private:
    [[nodiscard]] bool is_flat(const Vec3& a, const Vec3& b, const Vec3& c) const {
        const double doubled = (b - a).cross(c - a).norm();
        return doubled < 1e-9 * ((b - a).squaredNorm() + (c - b).squaredNorm() + (a - c).squaredNorm()) && are_collinear(a, b, c);
    }
    /// A triangle without area is the last resort: where a crack of no width has to be closed, and then mended.
    [[nodiscard]] double weigh(std::size_t i, std::size_t j, std::size_t k) const {
        const Vec3 &a = mesh_.vertices[loop_[i]], &b = mesh_.vertices[loop_[j]], &c = mesh_.vertices[loop_[k]];
        const double doubled = (b - a).cross(c - a).norm();
        const double edges_sq = (b - a).squaredNorm() + (c - b).squaredNorm() + (a - c).squaredNorm();
        if (!taken_.crossing.empty() && taken_.crossing.contains(sorted({loop_[i], loop_[j], loop_[k]}))) return kForbidden;
        if (doubled < 1e-9 * edges_sq && are_collinear(a, b, c)) return flat_weight_;
        return 0.5 * doubled + kRoundness * edges_sq;
    }
    /// cost(i, k): least weight of the triangles between the chord i-k and the loop from i to k. Kept by rows and by columns, so
    /// that both factors of the inner loop are read in the order of memory.
    bool find_least_area() {
        double length = 0.0;
        for (std::size_t i = 0; i < n_; ++i) length += (mesh_.vertices[loop_[(i + 1) % n_]] - mesh_.vertices[loop_[i]]).norm();
        flat_weight_ = static_cast<double>(n_) * length * length; // more than any patch of triangles with area
        by_row_.assign(n_ * n_, 0.0);
        by_column_.assign(n_ * n_, 0.0);
        apex_.assign(n_ * n_, 0);
        for (std::size_t span = 2; span < n_; ++span)
            for (std::size_t i = 0; i + span < n_; ++i)
                by_row_[i * n_ + i + span] = by_column_[(i + span) * n_ + i] = weigh_span(i, i + span);
        return by_row_[n_ - 1] < kForbidden;
    }
    double weigh_span(std::size_t i, std::size_t k) {
        const bool is_loop_edge = i == 0 && k == n_ - 1;
        if (!is_loop_edge && taken_.has(edge_of(loop_[i], loop_[k]))) return kForbidden; // would be a third triangle there
        const double *row = by_row_.data() + i * n_, *column = by_column_.data() + k * n_;
        double least = kForbidden;
        for (std::size_t j = i + 1; j < k; ++j) {
            const double sides = row[j] + column[j];
            if (!(sides < least)) continue;
            const double total = sides + weigh(i, j, k);
            if (total < least) least = total, apex_[i * n_ + k] = static_cast<Index>(j);
        }
        return least;
    }
    [[nodiscard]] std::vector<Triangle> list_patch() const {
        std::vector<Triangle> patch;
        std::vector<std::array<std::size_t, 2>> open{{0, n_ - 1}};
        while (!open.empty()) {
            const auto [i, k] = open.back();
            open.pop_back();
            if (k < i + 2) continue;
            const std::size_t j = apex_[i * n_ + k];
            patch.push_back({loop_[i], loop_[j], loop_[k]});
            open.push_back({i, j});
            open.push_back({j, k});
        }
        return patch;
    }
    /// Centre of the border line, not of its vertices, which may crowd.
    [[nodiscard]] Vec3 border_centre() const {
        Vec3 sum = Vec3::Zero();
        double length = 0.0;
        for (std::size_t i = 0; i < n_; ++i) {
            const Vec3 &a = mesh_.vertices[loop_[i]], &b = mesh_.vertices[loop_[(i + 1) % n_]];
            sum += (b - a).norm() * 0.5 * (a + b);
            length += (b - a).norm();
        }
        return length > 0.0 ? Vec3(sum / length) : mesh_.vertices[loop_[0]];
    }
    [[nodiscard]] bool sees_every_edge(const Vec3& centre) const {
        for (std::size_t i = 0; i < n_; ++i)
            if (is_flat(mesh_.vertices[loop_[i]], mesh_.vertices[loop_[(i + 1) % n_]], centre)) return false;
        return true;
    }
    /// The fan's hub: the centre, or beside it where it lies in line with an edge.
    [[nodiscard]] Vec3 find_hub() const {
        const Vec3 centre = border_centre();
        if (sees_every_edge(centre)) return centre;
        for (std::size_t i = 0; i < n_; ++i) {
            const Vec3 beside = centre + kBeside * (mesh_.vertices[loop_[i]] - centre);
            if (sees_every_edge(beside)) return beside;
        }
        return centre;
    }
    [[nodiscard]] std::vector<Triangle> make_fan() {
        const auto hub = static_cast<Index>(mesh_.vertices.size());
        mesh_.vertices.push_back(find_hub());
        std::vector<Triangle> fan;
        for (std::size_t i = 0; i < n_; ++i) fan.push_back({loop_[i], loop_[(i + 1) % n_], hub});
        return fan;
    }

    static constexpr double kForbidden = std::numeric_limits<double>::infinity();
    TriMesh& mesh_;
    const Loop& loop_;
    const Taken& taken_;
    std::size_t n_;
    double flat_weight_ = 0.0;
    std::vector<double> by_row_, by_column_;
    std::vector<Index> apex_;
};

void add_patch(TriMesh& mesh, const std::vector<Triangle>& patch, Taken& taken) {
    for (const Triangle& t : patch) {
        mesh.triangles.push_back(t);
        for (std::size_t k = 0; k < 3; ++k) taken.new_edges.insert(edge_of(t[k], t[(k + 1) % 3]));
    }
}

std::array<Vec3, 3> corners_of(const TriMesh& mesh, const Triangle& t) {
    return {mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]};
}

Box3 box_of(const TriMesh& mesh, const Triangle& t) {
    Box3 box;
    for (const Index v : t) box.add(mesh.vertices[v]);
    return box;
}

/// One patch to each loop. Where triangles of a patch cross something, its loop is filled again without them and without chords that
/// pierce the surface; the filling with the fewest crossings stays.
class HoleFiller {
public:
    HoleFiller(TriMesh& mesh, std::vector<Loop> loops)
        : bare_(mesh), mesh_(mesh), tree_(bare_), loops_(std::move(loops)), patches_(loops_.size()), stale_(loops_.size(), true),
          searched_(loops_.size(), false), edges_(unique_edges(mesh.triangles)) {
        tree_.find_common_vertices();
    }

    /// Returns the pairs of triangles that still cross because of a patch.
    std::size_t fill() {
        TriMesh best;
        std::size_t fewest = std::numeric_limits<std::size_t>::max();
        double asked = 0.0; // triangles, about
        for (int round = 0; round < kMaxFillings && asked < kMostWeighed; ++round) {
            asked += fill_once();
            const std::vector<Index> crossing = find_crossings();
            if (crossing.size() < fewest) {
                fewest = crossing.size();
                best = mesh_;
            }
            if (crossing.empty() || !forbid(crossing)) break;
        }
        mesh_ = std::move(best);
        return fewest;
    }

private:
    /// Returns how many triangles there were to weigh, about: those of fans as well, for which nothing else is to be found.
    double fill_once() {
        mesh_ = bare_;
        Taken taken{edges_, {}, piercing_, crossing_};
        loop_of_.clear();
        double asked = 0.0;
        for (std::size_t l = 0; l < loops_.size(); ++l) {
            const auto n = static_cast<double>(loops_[l].size());
            const double cost = n * n * n / 6.0;
            const bool has_hub = patches_[l].size() == loops_[l].size(); // its vertex went with the last filling
            if (stale_[l] || has_hub) {
                const bool weighs = loops_[l].size() <= kMaxOptimalLoop && weighed_ + cost <= kMostWeighed;
                patches_[l] = LoopFiller(mesh_, loops_[l], taken).fill(weighs);
                asked += cost;
                if (weighs) weighed_ += cost;
            }
            add_patch(mesh_, patches_[l], taken);
            loop_of_.resize(mesh_.triangles.size() - bare_.triangles.size(), l);
        }
        return asked;
    }
    /// The patches' triangle of each pair that crosses; of two in patches the later one.
    [[nodiscard]] std::vector<Index> find_crossings() const {
        const auto first = static_cast<Index>(bare_.triangles.size());
        const auto added = std::span(mesh_.triangles).subspan(first);
        TriangleTree new_tree;
        new_tree.build(mesh_.vertices, added);
        new_tree.find_common_vertices();
        std::vector<Index> crossing;
        std::size_t compared = 0;
        for (Index t = first; t < mesh_.triangles.size() && compared < kMostCompared; ++t) {
            const Triangle& own = mesh_.triangles[t];
            const auto corners = corners_of(mesh_, own);
            const auto note = [&](Index other) {
                if (++compared < kMostCompared && triangles_cross(corners, corners_of(mesh_, mesh_.triangles[other]), Crossing::Proper))
                    crossing.push_back(t);
            };
            const Box3 box = box_of(mesh_, own);
            tree_.for_each_overlapping_apart(box, own, note);
            new_tree.for_each_overlapping_apart(box, own, [&](Index slot) {
                if (first + slot < t) note(first + slot);
            });
        }
        return crossing;
    }
    /// Marks the loops whose patches have to be found anew. False where nothing can be forbidden: fans have no other form.
    bool forbid(const std::vector<Index>& crossing) {
        stale_.assign(loops_.size(), false);
        bool any = false;
        for (const Index t : crossing) {
            const Triangle corners = sorted(mesh_.triangles[t]);
            if (corners[2] >= bare_.vertices.size()) continue;
            const std::size_t loop = loop_of_[t - bare_.triangles.size()];
            crossing_.insert(corners);
            any = stale_[loop] = true;
            forbid_piercing_chords(loop);
        }
        return any;
    }
    void forbid_piercing_chords(std::size_t l) {
        const Loop& loop = loops_[l];
        if (searched_[l] || loop.size() > kMaxSearchedLoop) return;
        searched_[l] = true;
        for (std::size_t i = 0; i < loop.size(); ++i)
            for (std::size_t k = i + 2; k < loop.size(); ++k) {
                const Vec3 &p = bare_.vertices[loop[i]], &q = bare_.vertices[loop[k]];
                bool pierces = false;
                const Triangle chord{loop[i], loop[k], loop[k]};
                tree_.for_each_overlapping_apart(box_of(bare_, chord), chord, [&](Index t) {
                    pierces = pierces || segment_pierces(p, q, corners_of(bare_, bare_.triangles[t]));
                });
                if (pierces) piercing_.insert(edge_of(loop[i], loop[k]));
            }
    }

    const TriMesh bare_;
    TriMesh& mesh_;
    TriangleTree tree_; // of bare_
    std::vector<Loop> loops_;
    std::vector<std::vector<Triangle>> patches_;
    std::vector<bool> stale_, searched_; // [loop]
    std::vector<std::size_t> loop_of_;   // [new triangle]
    std::vector<Edge> edges_;
    std::set<Edge> piercing_;
    std::set<Triangle> crossing_;
    double weighed_ = 0.0; // triangles of all fillings so far, about
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
    const auto before = static_cast<Index>(mesh.triangles.size());
    step.holes_filled = loops.size();
    if (!loops.empty()) step.crossings_made = HoleFiller(mesh, loops).fill();
    step.triangles_added = mesh.triangles.size() - before;
    flatten_new(mesh, before, step);
    return step;
}

} // namespace trocar::repairs
