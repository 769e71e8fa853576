#include "assets/anatomy/remesh.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

namespace trocar::anatomy {
namespace {

/// Edges outside [kShort, kLong] times the wanted length are collapsed or split: the band that Botsch & Kobbelt show to
/// make both operations improve an edge.
constexpr double kShort = 4.0 / 5.0;
constexpr double kLong = 4.0 / 3.0;
/// A triangle whose normal leaves the field's by more than this cosine counts as turned over.
constexpr double kLeastFacing = 0.35;
/// Shape (1: equilateral, 0: needle) that a change must leave behind, unless it was worse there before.
constexpr double kLeastShape = 0.3;

struct Edge {
    Index a, b;
    double length;
};

class Remesher {
public:
    Remesher(const TriMesh& mesh, const Field& field, const std::function<double(const Vec3&)>& size)
        : field_(field), size_(size), x_(mesh.vertices), triangles_(mesh.triangles), around_(mesh.vertices.size()) {
        for (Index t = 0; t < triangles_.size(); ++t)
            for (const Index v : triangles_[t]) around_[v].push_back(t);
        // The first polygons are close to the field already: their own normals do until most vertices are gone.
        normal_.assign(x_.size(), Vec3::Zero());
        for (const Triangle& t : triangles_)
            for (const Index v : t) normal_[v] += area_vector(t);
        for (Vec3& n : normal_) n.normalize();
        for (const Vec3& x : x_) wanted_.push_back(size_(x));
    }

    /// Scales the size field so that the surface holds `count` equilateral triangles of the wanted size.
    void aim_at(std::size_t count) {
        double needed = 0.0; // triangles at scale 1
        for (const Triangle& t : triangles_) {
            if (t[0] == kNoIndex) continue;
            const double edge = (wanted_[t[0]] + wanted_[t[1]] + wanted_[t[2]]) / 3;
            needed += 0.5 * area_vector(t).norm() / (0.25 * std::sqrt(3.0) * edge * edge);
        }
        const double factor = std::sqrt(needed / static_cast<double>(count));
        scale_ *= factor;
        for (double& w : wanted_) w *= factor;
    }

    void split_long_edges() {
        for (const Edge& e : edges(kLong, false)) split(e.a, e.b);
    }
    void collapse_short_edges() {
        for (const Edge& e : edges(kShort, true))
            if (!around_[e.a].empty() && !around_[e.b].empty()) collapse(e.a, e.b);
    }
    void flip_edges() {
        for (Index t = 0; t < triangles_.size(); ++t)
            for (int corner = 0; corner < 3; ++corner) {
                if (triangles_[t][0] == kNoIndex) break;
                const Index a = triangles_[t][corner], b = triangles_[t][(corner + 1) % 3];
                if (a < b) flip(a, b);
            }
    }
    /// A vertex with three triangles only blocks its neighbours' collapses: one triangle takes its place.
    void drop_pits() {
        for (Index v = 0; v < x_.size(); ++v)
            if (around_[v].size() == 3) drop_pit(v);
    }
    void relax() {
        for (Index v = 0; v < x_.size(); ++v)
            if (!around_[v].empty()) relax(v);
    }

    [[nodiscard]] std::size_t live_triangles() const {
        return static_cast<std::size_t>(
            std::count_if(triangles_.begin(), triangles_.end(), [](const Triangle& t) { return t[0] != kNoIndex; }));
    }

    [[nodiscard]] TriMesh result() const {
        TriMesh out;
        std::vector<Index> renumbered(x_.size(), kNoIndex);
        for (Triangle t : triangles_) {
            if (t[0] == kNoIndex) continue;
            for (Index& v : t) {
                if (renumbered[v] == kNoIndex) {
                    renumbered[v] = static_cast<Index>(out.vertices.size());
                    out.vertices.push_back(x_[v]);
                }
                v = renumbered[v];
            }
            out.triangles.push_back(t);
        }
        return out;
    }

private:
    const Field& field_;
    const std::function<double(const Vec3&)>& size_;
    double scale_ = 1.0;
    std::vector<Vec3> x_;
    std::vector<Vec3> normal_;               // [vertex] the field's
    std::vector<double> wanted_;             // [vertex] m, edge length
    std::vector<Triangle> triangles_;        // first index kNoIndex: removed
    std::vector<std::vector<Index>> around_; // [vertex] triangles; empty: removed
    std::vector<Index> ring_a_, ring_b_;

    [[nodiscard]] Vec3 area_vector(const Triangle& t) const { return (x_[t[1]] - x_[t[0]]).cross(x_[t[2]] - x_[t[0]]); }
    [[nodiscard]] double wanted(Index a, Index b) const { return 0.5 * (wanted_[a] + wanted_[b]); }
    [[nodiscard]] double length(Index a, Index b) const { return (x_[a] - x_[b]).norm(); }

    /// Puts a vertex onto the zero set and renews what is known there.
    void settle(Index v) {
        for (int newton = 0; newton < 2; ++newton) {
            const Vec3 slope = field_.gradient(x_[v]);
            const double steep_sq = slope.squaredNorm();
            if (!(steep_sq > 1e-6)) break;
            Vec3 move = -field_.value(x_[v]) / steep_sq * slope;
            const double limit = 0.3 * wanted_[v];
            if (move.norm() > limit) move *= limit / move.norm();
            x_[v] += move;
            normal_[v] = slope / std::sqrt(steep_sq);
            if (move.norm() < 0.01 * limit) break;
        }
        wanted_[v] = scale_ * size_(x_[v]);
    }

    /// Edges beyond the bound, once each, from the worst to the best; ties by vertex ids.
    [[nodiscard]] std::vector<Edge> edges(double bound, bool shorter) const {
        std::vector<Edge> found;
        for (const Triangle& t : triangles_) {
            if (t[0] == kNoIndex) continue;
            for (int corner = 0; corner < 3; ++corner) {
                const Index a = t[corner], b = t[(corner + 1) % 3];
                if (a > b) continue;
                const double ratio = length(a, b) / wanted(a, b);
                if (shorter ? ratio < bound : ratio > bound) found.push_back({a, b, shorter ? ratio : -ratio});
            }
        }
        std::sort(found.begin(), found.end(),
                  [](const Edge& l, const Edge& r) { return std::tie(l.length, l.a, l.b) < std::tie(r.length, r.a, r.b); });
        return found;
    }

    /// The two triangles on edge ab; false when it is no longer an edge.
    [[nodiscard]] bool sides(Index a, Index b, std::array<Index, 2>& side) const {
        int count = 0;
        for (const Index t : around_[a])
            if (std::find(triangles_[t].begin(), triangles_[t].end(), b) != triangles_[t].end()) {
                if (count == 2) return false;
                side[static_cast<std::size_t>(count++)] = t;
            }
        return count == 2;
    }
    [[nodiscard]] Index apex(Index t, Index a, Index b) const {
        for (const Index v : triangles_[t])
            if (v != a && v != b) return v;
        return kNoIndex;
    }
    void ring(Index v, std::vector<Index>& out) const {
        out.clear();
        for (const Index t : around_[v])
            for (const Index w : triangles_[t])
                if (w != v) out.push_back(w);
        std::sort(out.begin(), out.end());
        out.erase(std::unique(out.begin(), out.end()), out.end());
    }
    void detach(Index v, Index t) { std::erase(around_[v], t); }
    void replace(Index t, Index from, Index to) { std::replace(triangles_[t].begin(), triangles_[t].end(), from, to); }

    /// 1 for an equilateral triangle, 0 for a needle, negative when it faces against the field.
    [[nodiscard]] double shape(const Triangle& t) const {
        const Vec3 &p0 = x_[t[0]], &p1 = x_[t[1]], &p2 = x_[t[2]];
        const Vec3 area = (p1 - p0).cross(p2 - p0);
        const double size = area.norm();
        if (area.dot(mean_normal(t)) < kLeastFacing * size) return -1.0;
        return 2 * std::sqrt(3.0) * size / ((p1 - p0).squaredNorm() + (p2 - p1).squaredNorm() + (p0 - p2).squaredNorm());
    }
    /// Over the triangles around v.
    [[nodiscard]] double worst_shape(Index v) const {
        double worst = 1.0;
        for (const Index t : around_[v]) worst = std::min(worst, shape(triangles_[t]));
        return worst;
    }
    [[nodiscard]] Vec3 mean_normal(const Triangle& t) const { return (normal_[t[0]] + normal_[t[1]] + normal_[t[2]]).normalized(); }

    void split(Index a, Index b) {
        std::array<Index, 2> side{};
        if (!(length(a, b) > kLong * wanted(a, b)) || !sides(a, b, side)) return;
        const auto middle = static_cast<Index>(x_.size());
        x_.push_back(0.5 * (x_[a] + x_[b]));
        normal_.push_back((normal_[a] + normal_[b]).normalized());
        wanted_.push_back(wanted(a, b));
        around_.emplace_back();
        for (const Index t : side) {
            const auto fresh = static_cast<Index>(triangles_.size());
            Triangle copy = triangles_[t];
            std::replace(copy.begin(), copy.end(), a, middle);
            triangles_.push_back(copy);
            const Index c = apex(t, a, b);
            replace(t, b, middle);
            detach(b, t);
            around_[b].push_back(fresh);
            around_[c].push_back(fresh);
            around_[middle].push_back(t);
            around_[middle].push_back(fresh);
        }
    }

    /// Merges b into a at the middle of the edge. Refused where the link condition fails (Dey et al. 1999).
    void collapse(Index a, Index b) {
        std::array<Index, 2> side{};
        if (!(length(a, b) < kShort * wanted(a, b)) || !sides(a, b, side)) return;
        ring(a, ring_a_);
        ring(b, ring_b_);
        std::size_t shared = 0;
        for (const Index v : ring_a_) shared += std::binary_search(ring_b_.begin(), ring_b_.end(), v);
        if (shared != 2 || ring_a_.size() + ring_b_.size() < 8) return;
        for (const Index t : side)
            if (around_[apex(t, a, b)].size() <= 3) return;

        // A knot of tiny edges comes apart only through worse shapes on the way; relaxing mends them afterwards.
        const bool tiny = length(a, b) < 0.35 * wanted(a, b);
        const double least = (tiny ? 0.2 : 1.0) * std::min(kLeastShape, std::min(worst_shape(a), worst_shape(b)));
        const Vec3 old_a = x_[a], old_normal = normal_[a];
        const double old_wanted = wanted_[a];
        x_[a] = 0.5 * (x_[a] + x_[b]); // relax() takes it back to the field
        normal_[a] = (normal_[a] + normal_[b]).normalized();
        wanted_[a] = wanted(a, b);
        if (!may_stand_at(a, b, side, least)) {
            x_[a] = old_a;
            normal_[a] = old_normal;
            wanted_[a] = old_wanted;
            return;
        }
        for (const Index t : side) {
            for (const Index v : triangles_[t]) detach(v, t);
            triangles_[t][0] = kNoIndex;
        }
        for (const Index t : around_[b]) {
            replace(t, b, a);
            around_[a].push_back(t);
        }
        around_[b].clear();
    }
    /// The triangles of a and b, with both moved to a's place, keep their shape, and no edge grows too long.
    [[nodiscard]] bool may_stand_at(Index a, Index b, const std::array<Index, 2>& side, double least) const {
        for (const Index from : {a, b})
            for (const Index t : around_[from]) {
                if (t == side[0] || t == side[1]) continue;
                Triangle moved = triangles_[t];
                std::replace(moved.begin(), moved.end(), b, a);
                if (const double s = shape(moved); s < least || s <= 0) return false;
                for (const Index v : moved)
                    if (v != a && length(a, v) > kLong * wanted(a, v)) return false;
            }
        return true;
    }

    void flip(Index a, Index b) {
        std::array<Index, 2> side{};
        if (!sides(a, b, side)) return;
        const Index c = apex(side[0], a, b), d = apex(side[1], a, b);
        if (c == d) return;
        const auto excess = [&](Index v, int change) {
            const int e = static_cast<int>(around_[v].size()) + change - 6;
            return e * e;
        };
        const int before = excess(a, 0) + excess(b, 0) + excess(c, 0) + excess(d, 0);
        const int after = excess(a, -1) + excess(b, -1) + excess(c, 1) + excess(d, 1);
        const double worst_now = std::min(shape(triangles_[side[0]]), shape(triangles_[side[1]]));
        const bool for_shape = worst_now < 2 * kLeastShape;
        if ((after >= before && !for_shape) || around_[a].size() <= 3 || around_[b].size() <= 3) return;
        if (length(c, d) > 1.5 * wanted(c, d)) return;
        ring(c, ring_a_);
        if (std::binary_search(ring_a_.begin(), ring_a_.end(), d)) return;
        Triangle t0 = triangles_[side[0]], t1 = triangles_[side[1]];
        std::replace(t0.begin(), t0.end(), b, d); // a, c, d in t0's turn
        std::replace(t1.begin(), t1.end(), a, c); // b, d, c in t1's turn
        const double shape_after = std::min(shape(t0), shape(t1));
        if (shape_after <= 0 || shape_after < std::min(kLeastShape, worst_now)) return;
        if (after >= before && shape_after < 1.2 * worst_now) return;
        triangles_[side[0]] = t0;
        triangles_[side[1]] = t1;
        detach(b, side[0]);
        detach(a, side[1]);
        around_[d].push_back(side[0]);
        around_[c].push_back(side[1]);
    }

    void drop_pit(Index v) {
        const Index t0 = around_[v][0], t1 = around_[v][1], t2 = around_[v][2];
        Triangle merged = triangles_[t0]; // v's place is taken by the corner that t0 lacks
        for (const Index w : triangles_[t1])
            if (std::find(merged.begin(), merged.end(), w) == merged.end()) std::replace(merged.begin(), merged.end(), v, w);
        if (shape(merged) <= 0) return;
        for (const Index w : merged)
            if (around_[w].size() <= 3) return;
        for (const Index t : {t1, t2}) {
            const Triangle old = triangles_[t];
            for (const Index w : old) detach(w, t);
            triangles_[t][0] = kNoIndex;
        }
        around_[v].clear();
        triangles_[t0] = merged;
        for (const Index w : merged)
            if (std::find(around_[w].begin(), around_[w].end(), t0) == around_[w].end()) around_[w].push_back(t0);
    }

    /// Moves a vertex along the surface to the weighted centre of its triangles, unless a triangle would turn over.
    void relax(Index v) {
        Vec3 centre = Vec3::Zero();
        double weight = 0.0;
        for (const Index t : around_[v]) {
            const Triangle& tri = triangles_[t];
            const double edge = (wanted_[tri[0]] + wanted_[tri[1]] + wanted_[tri[2]]) / 3;
            const double w = area_vector(tri).norm() / (edge * edge);
            centre += w * (x_[tri[0]] + x_[tri[1]] + x_[tri[2]]) / 3;
            weight += w;
        }
        if (!(weight > 0)) return;
        const double least = std::min(kLeastShape, worst_shape(v));
        const Vec3 old = x_[v], old_normal = normal_[v];
        const double old_wanted = wanted_[v];
        const Vec3 move = centre / weight - x_[v];
        x_[v] += 0.8 * (move - move.dot(normal_[v]) * normal_[v]);
        settle(v);
        if (worst_shape(v) >= least) return;
        x_[v] = old;
        normal_[v] = old_normal;
        wanted_[v] = old_wanted;
    }
};

} // namespace

TriMesh remesh(const TriMesh& mesh, const Field& field, const std::function<double(const Vec3&)>& size, const RemeshOptions& options) {
    Remesher work(mesh, field, size);
    work.aim_at(options.triangles);
    for (int round = 0; round < options.rounds; ++round) {
        work.split_long_edges();
        work.collapse_short_edges();
        work.drop_pits();
        work.flip_edges();
        work.relax();
        if (round + 3 == options.rounds) work.aim_at(2 * options.triangles - work.live_triangles());
    }
    work.flip_edges();
    work.relax();
    return work.result();
}

} // namespace trocar::anatomy
