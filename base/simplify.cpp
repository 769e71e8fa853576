// Garland & Heckbert, "Surface simplification using quadric error metrics" (1997), with area-weighted planes. The surface is
// scaled into a unit box first: squared distances to planes far from the origin cancel badly.
#include "base/simplify.hpp"

#include "base/topology.hpp"

#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <optional>
#include <queue>
#include <utility>

namespace trocar {
namespace {

constexpr double kMaxTurnCosine = 0.2; // a triangle's normal may turn by acos of it, 78 degrees, in one collapse
constexpr double kPoorQuality = 0.1;   // 1 equilateral, 0 flat: below it no triangle may get worse
constexpr double kShapeWeight = 1e-5;  // cost of an edge's squared length per area: flat regions collapse evenly
constexpr double kMidpointPull = 1e-3; // share of the quadric's trace: keeps the optimum near where the quadric is flat

/// Sum of area-weighted squared distances to planes: x^T a x + 2 b^T x + c, and the area gathered.
struct Quadric {
    Mat3 a = Mat3::Zero();
    Vec3 b = Vec3::Zero();
    double c = 0.0;
    double area = 0.0;

    void add_plane(const Vec3& unit_normal, const Vec3& point, double weight) {
        const double offset = -unit_normal.dot(point);
        a += weight * unit_normal * unit_normal.transpose();
        b += weight * offset * unit_normal;
        c += weight * offset * offset;
    }
    Quadric& operator+=(const Quadric& other) {
        a += other.a;
        b += other.b;
        c += other.c;
        area += other.area;
        return *this;
    }
    [[nodiscard]] double at(const Vec3& x) const { return std::max(0.0, x.dot(a * x) + 2.0 * b.dot(x) + c); }
};

struct Collapse {
    double cost;
    Index lo, hi;
    std::uint32_t lo_version, hi_version;
    bool operator<(const Collapse& o) const { // the heap's top is its greatest: the cheapest, then the lowest ids
        if (cost != o.cost) return cost > o.cost;
        return lo != o.lo ? lo > o.lo : hi > o.hi;
    }
};

/// 1 for an equilateral triangle, 0 for one without area.
double quality(const Vec3& a, const Vec3& b, const Vec3& c) {
    const double edges_sq = (b - a).squaredNorm() + (c - b).squaredNorm() + (a - c).squaredNorm();
    return edges_sq > 0.0 ? 2.0 * std::sqrt(3.0) * (b - a).cross(c - a).norm() / edges_sq : 0.0;
}

class Simplifier {
public:
    Simplifier(const TriMesh& mesh, const SimplifyOptions& options);
    void reduce_to(std::size_t target);
    [[nodiscard]] TriMesh result() const;

private:
    [[nodiscard]] Vec3 best_position(const Quadric& q, Index lo, Index hi) const;
    void push(Index lo, Index hi, bool only_later = false);
    bool collapse(Index lo, Index hi);
    [[nodiscard]] bool keeps_topology(Index lo, Index hi) const;
    [[nodiscard]] bool keeps_shape(Index moved, Index other, const Vec3& target) const;
    [[nodiscard]] std::vector<Index> neighbours(Index v) const;
    [[nodiscard]] bool has(Index t, Index v) const { return triangles_[t][0] == v || triangles_[t][1] == v || triangles_[t][2] == v; }
    void begin_round();
    void wake(Index v);
    void note_change(Index lo, const std::vector<Index>& around_lo);

    Vec3 origin_;
    double scale_;
    double cost_limit_;
    std::vector<Vec3> position_;
    std::vector<Quadric> quadric_;
    std::vector<std::uint32_t> version_;
    std::vector<bool> on_border_;
    std::vector<Triangle> triangles_;
    std::vector<bool> alive_;
    std::vector<std::vector<Index>> around_; // [vertex] living triangles
    std::size_t living_ = 0;
    std::priority_queue<Collapse> heap_;
    // A collapse that was refused is tried again once its surroundings have changed, as if every round tried all of them.
    std::uint32_t round_ = 0;
    std::vector<std::uint32_t> awake_;         // [vertex] last round in which all its edges were in the heap
    std::vector<std::uint32_t> changed_round_; // [vertex] last round in which its triangles changed
    std::vector<Index> changed_;               // in this round, each once
    std::optional<Collapse> latest_;           // of those that this round has taken from the heap, the last in its order
};

Simplifier::Simplifier(const TriMesh& mesh, const SimplifyOptions& options)
    : position_(mesh.vertices), quadric_(mesh.vertices.size()), version_(mesh.vertices.size(), 0), on_border_(mesh.vertices.size(), false),
      triangles_(mesh.triangles), alive_(mesh.triangles.size(), true), around_(mesh.vertices.size()), living_(mesh.triangles.size()),
      awake_(mesh.vertices.size(), 0), changed_round_(mesh.vertices.size(), 0) {
    const Box3 box = mesh.bounds();
    origin_ = box.centre();
    scale_ = box.longest_edge();
    cost_limit_ = options.max_error / scale_;
    for (Vec3& x : position_) x = (x - origin_) / scale_;
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
        const auto& [a, b, c] = triangles_[t];
        const Vec3 twice = (position_[b] - position_[a]).cross(position_[c] - position_[a]);
        const double length = twice.norm();
        Quadric q;
        if (length > 0.0) q.add_plane(twice / length, position_[a], 0.5 * length);
        q.area = 0.5 * length;
        for (const Index v : triangles_[t]) {
            quadric_[v] += q;
            around_[v].push_back(static_cast<Index>(t));
        }
    }
    for_each_edge(sorted_edge_uses(triangles_), [&](std::span<const EdgeUse> edge) {
        if (edge.size() != 1) return;
        const Index lo = edge[0].lo, hi = edge[0].hi;
        on_border_[lo] = on_border_[hi] = true;
        const auto& [a, b, c] = triangles_[edge[0].triangle];
        const Vec3 along = position_[hi] - position_[lo];
        const Vec3 across = along.cross((position_[b] - position_[a]).cross(position_[c] - position_[a]));
        if (!(across.norm() > 0.0)) return;
        Quadric q;
        q.add_plane(across.normalized(), position_[lo], options.boundary_weight * along.squaredNorm());
        quadric_[lo] += q;
        quadric_[hi] += q;
    });
}

std::vector<Index> Simplifier::neighbours(Index v) const {
    std::vector<Index> out;
    for (const Index t : around_[v])
        for (const Index w : triangles_[t])
            if (w != v) out.push_back(w);
    std::sort(out.begin(), out.end());
    out.erase(std::unique(out.begin(), out.end()), out.end());
    return out;
}

Vec3 Simplifier::best_position(const Quadric& q, Index lo, Index hi) const {
    const Vec3 middle = 0.5 * (position_[lo] + position_[hi]);
    if (on_border_[lo] != on_border_[hi]) return on_border_[lo] ? position_[lo] : position_[hi];
    const double pull = kMidpointPull * q.a.trace();
    if (!(pull > 0.0)) return middle;
    const Mat3 a = q.a + pull * Mat3::Identity();
    const Vec3 step = a.inverse() * -(q.a * middle + q.b); // a is symmetric positive definite: the pull bounds its condition
    // a far optimum is an artefact of nearly parallel planes
    return step.squaredNorm() <= (position_[hi] - position_[lo]).squaredNorm() ? Vec3(middle + step) : middle;
}

/// only_later  not where its turn in this round has passed
void Simplifier::push(Index lo, Index hi, bool only_later) {
    if (lo > hi) std::swap(lo, hi);
    Quadric q = quadric_[lo];
    q += quadric_[hi];
    const double error = q.at(best_position(q, lo, hi));
    if (error > cost_limit_ * cost_limit_ * q.area) return;
    const double shape = kShapeWeight * q.area * (position_[hi] - position_[lo]).squaredNorm();
    const Collapse made{error + shape, lo, hi, version_[lo], version_[hi]};
    if (!only_later || !latest_ || made < *latest_) heap_.push(made);
}

/// The link condition (Dey, Edelsbrunner, Guha, Nekhayev 1999), for surfaces with border.
bool Simplifier::keeps_topology(Index lo, Index hi) const {
    std::size_t sides = 0;
    for (const Index t : around_[lo]) {
        if (!has(t, hi)) continue;
        ++sides;
        for (const Index v : triangles_[t])
            if (v != lo && v != hi && around_[v].size() <= (on_border_[v] ? 1u : 3u)) return false;
    }
    if (sides == 0 || (on_border_[lo] && on_border_[hi] && sides != 1)) return false;
    const auto a = neighbours(lo), b = neighbours(hi);
    std::size_t shared = 0;
    for (auto i = a.begin(), j = b.begin(); i != a.end() && j != b.end();)
        if (*i < *j)
            ++i;
        else if (*j < *i)
            ++j;
        else
            ++shared, ++i, ++j;
    return shared == sides;
}

bool Simplifier::keeps_shape(Index moved, Index other, const Vec3& target) const {
    for (const Index t : around_[moved]) {
        if (has(t, other)) continue;
        std::array<Vec3, 3> before, after;
        for (std::size_t k = 0; k < 3; ++k) {
            before[k] = position_[triangles_[t][k]];
            after[k] = triangles_[t][k] == moved ? target : before[k];
        }
        const Vec3 old_normal = (before[1] - before[0]).cross(before[2] - before[0]);
        const Vec3 new_normal = (after[1] - after[0]).cross(after[2] - after[0]);
        const double new_quality = quality(after[0], after[1], after[2]);
        if (!(new_quality > 0.0)) return false;
        if (old_normal.dot(new_normal) < kMaxTurnCosine * old_normal.norm() * new_normal.norm()) return false;
        if (new_quality < kPoorQuality && new_quality < quality(before[0], before[1], before[2])) return false;
    }
    return true;
}

/// hi goes into lo, unless that would harm the surface.
bool Simplifier::collapse(Index lo, Index hi) {
    if (!keeps_topology(lo, hi)) return false;
    Quadric q = quadric_[lo];
    q += quadric_[hi];
    const Vec3 target = best_position(q, lo, hi);
    if (!keeps_shape(lo, hi, target) || !keeps_shape(hi, lo, target)) return false;
    std::vector<Index> kept;
    for (const Index t : around_[lo])
        if (!has(t, hi)) kept.push_back(t);
    for (const Index t : around_[hi]) {
        if (!has(t, lo)) {
            for (Index& v : triangles_[t])
                if (v == hi) v = lo;
            kept.push_back(t);
            continue;
        }
        alive_[t] = false;
        --living_;
        for (const Index v : triangles_[t])
            if (v != lo && v != hi) std::erase(around_[v], t);
    }
    around_[hi].clear();
    around_[lo] = std::move(kept);
    on_border_[lo] = on_border_[lo] || on_border_[hi];
    position_[lo] = target;
    quadric_[lo] = q;
    ++version_[lo];
    ++version_[hi];
    const std::vector<Index> around_lo = neighbours(lo);
    note_change(lo, around_lo);
    for (const Index v : around_lo) push(lo, v);
    return true;
}

/// Its edges join the round, if they are not in it.
void Simplifier::wake(Index v) {
    if (awake_[v] == round_) return;
    for (const Index w : neighbours(v))
        if (awake_[w] != round_) push(v, w, true);
    awake_[v] = round_;
}

/// Whether an edge may collapse depends on the triangles of its ends, and on how many those across from it have.
void Simplifier::note_change(Index lo, const std::vector<Index>& around_lo) {
    const auto note = [this](Index v) {
        if (changed_round_[v] != round_) changed_.push_back(v);
        changed_round_[v] = round_;
    };
    note(lo);
    for (const Index v : around_lo) note(v);
    if (round_ == 1) return; // all are awake
    awake_[lo] = round_;     // all its edges are pushed anew
    for (const Index v : around_lo) {
        wake(v);
        for (const Index t : around_[v])
            for (const Index w : triangles_[t]) wake(w);
    }
}

/// The first has all edges, a later one those whose surroundings have changed in the round before.
void Simplifier::begin_round() {
    heap_ = {};
    latest_.reset();
    const std::vector<Index> changed = std::exchange(changed_, {});
    if (++round_ == 1) {
        for (const auto& [lo, hi] : unique_edges(triangles_)) push(lo, hi);
        std::fill(awake_.begin(), awake_.end(), round_);
        return;
    }
    for (const Index v : changed) {
        wake(v);
        for (const Index w : neighbours(v)) wake(w);
    }
}

void Simplifier::reduce_to(std::size_t target) {
    // A refused collapse may become possible once its surroundings have changed: go round until nothing does.
    for (bool progress = true; progress && living_ > target;) {
        progress = false;
        begin_round();
        while (!heap_.empty() && living_ > target) {
            const Collapse next = heap_.top();
            heap_.pop();
            if (!latest_ || next < *latest_) latest_ = next;
            if (next.lo_version != version_[next.lo] || next.hi_version != version_[next.hi]) continue;
            if (collapse(next.lo, next.hi)) progress = true;
        }
    }
}

TriMesh Simplifier::result() const {
    TriMesh out;
    out.vertices.reserve(position_.size());
    for (const Vec3& x : position_) out.vertices.push_back(origin_ + scale_ * x);
    for (std::size_t t = 0; t < triangles_.size(); ++t)
        if (alive_[t]) out.triangles.push_back(triangles_[t]);
    drop_unreferenced_vertices(out);
    return out;
}

Result<void> check_input(const TriMesh& mesh, std::size_t target) {
    const SurfaceReport report = inspect_surface(mesh);
    const auto bad = [](const std::string& why) { return Error{ErrorCode::BadMesh, "cannot simplify: " + why}; };
    if (target == 0) return Error{ErrorCode::BadValue, "cannot simplify to 0 triangles: give a count of 4 or more"};
    if (report.triangles == 0) return bad("the surface has no triangles");
    if (!report.finite()) return bad(std::to_string(report.non_finite_vertices) + " vertices are not finite");
    if (report.nonmanifold_edges + report.nonmanifold_vertices + report.duplicate_triangles > 0)
        return bad("the surface is not manifold; the repair drop_non_manifold cuts it into manifold parts");
    for (const Triangle& t : mesh.triangles)
        for (std::size_t k = 0; k < 3; ++k)
            if (t[k] >= mesh.vertices.size() || t[k] == t[(k + 1) % 3])
                return bad("a triangle repeats a vertex or names one that does not exist; drop_degenerate removes such");
    if (!(mesh.bounds().longest_edge() > 0.0)) return bad("the surface has no extent");
    return {};
}

} // namespace

Result<TriMesh> simplify(const TriMesh& mesh, std::size_t target_triangles, const SimplifyOptions& options) {
    if (const Result<void> check = check_input(mesh, target_triangles); !check) return check.error();
    Simplifier simplifier(mesh, options);
    simplifier.reduce_to(target_triangles);
    return simplifier.result();
}

} // namespace trocar
