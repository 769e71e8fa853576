#include "spheretree/build/tree_quality.hpp"

#include "base/topology.hpp"
#include "spheretree/bounding.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::spheretree {

namespace {

using Corners = std::array<Vec3, 3>;

double area_of(const Corners& c) { return 0.5 * (c[1] - c[0]).cross(c[2] - c[0]).norm(); }

/// Halves through the middle of the longest edge.
std::array<Corners, 2> halve(const Corners& c, double& longest_sq) {
    std::size_t k = 0;
    longest_sq = -1.0;
    for (std::size_t e = 0; e < 3; ++e)
        if (const double l = (c[e] - c[(e + 1) % 3]).squaredNorm(); l > longest_sq) {
            longest_sq = l;
            k = e;
        }
    const Vec3 middle = 0.5 * (c[k] + c[(k + 1) % 3]);
    return {Corners{c[k], middle, c[(k + 2) % 3]}, Corners{middle, c[(k + 1) % 3], c[(k + 2) % 3]}};
}

bool holds(const Sphere& s, const Corners& c) {
    if (s.radius < 0.0) return false;
    const double limit = s.radius * s.radius * kRoundOut;
    return (c[0] - s.centre).squaredNorm() <= limit && (c[1] - s.centre).squaredNorm() <= limit && (c[2] - s.centre).squaredNorm() <= limit;
}

bool meets(const Sphere& s, const Corners& c) {
    return s.radius >= 0.0 && closest_on_triangle(s.centre, c[0], c[1], c[2]).distance_sq <= s.radius * s.radius * kRoundOut;
}

/// Area of a part by what becomes of it in one walk down the tree.
class CoverWalk {
public:
    CoverWalk(const SphereTree& tree, double finest) : tree_(tree), finest_sq_(finest * finest) {}

    /// Area that spheres of the level hold, reached through parents that hold the same part (or through any).
    double held(const Corners& triangle, std::size_t level, bool through_parents) {
        level_ = level;
        through_parents_ = through_parents;
        std::vector<Index> all;
        if (through_parents) {
            all.assign(1, 0);
        } else {
            for (Index s = tree_.level_begin[level]; s < tree_.level_begin[level + 1]; ++s)
                if (meets(tree_.spheres[s], triangle)) all.push_back(s);
        }
        return held_by(triangle, all, 0);
    }

private:
    /// near  spheres that may hold the part: of the level, or roots to descend from
    double held_by(const Corners& part, const std::vector<Index>& near, int cuts) {
        if (through_parents_ ? reached(part, 0)
                             : std::any_of(near.begin(), near.end(), [&](Index s) { return holds(tree_.spheres[s], part); }))
            return area_of(part);
        double longest_sq = 0.0;
        const auto halves = halve(part, longest_sq);
        if (longest_sq <= finest_sq_ || cuts > 60 || (through_parents_ && !may_reach(part, 0))) return 0.0;
        double sum = 0.0;
        for (const Corners& half : halves) {
            std::vector<Index> fewer;
            for (const Index s : near)
                if (through_parents_ || meets(tree_.spheres[s], half)) fewer.push_back(s);
            if (!fewer.empty()) sum += held_by(half, fewer, cuts + 1);
        }
        return sum;
    }
    [[nodiscard]] bool reached(const Corners& part, Index s) const {
        if (!holds(tree_.spheres[s], part)) return false;
        if (tree_.level[s] == level_ || tree_.is_leaf(s)) return true;
        for (Index k = 0; k < tree_.child_count[s]; ++k)
            if (reached(part, tree_.first_child[s] + k)) return true;
        return false;
    }

    /// Could any part of it be reached?
    [[nodiscard]] bool may_reach(const Corners& part, Index s) const {
        if (!meets(tree_.spheres[s], part)) return false;
        if (tree_.level[s] == level_ || tree_.is_leaf(s)) return true;
        for (Index k = 0; k < tree_.child_count[s]; ++k)
            if (may_reach(part, tree_.first_child[s] + k)) return true;
        return false;
    }

    const SphereTree& tree_;
    double finest_sq_;
    std::size_t level_ = 0;
    bool through_parents_ = false;
};

/// Places spread evenly on the unit sphere, z descending: neighbouring turns are a golden angle apart.
/// source   Vogel 1979 (phyllotaxis), on the sphere; the angle is turned by a fixed rotation, so no trigonometry is needed
std::vector<Vec3> spread_directions(unsigned count) {
    constexpr double kCos = -0.73736887807831985, kSin = 0.67549029426152364; // of the golden angle
    std::vector<Vec3> directions;
    double x = 1.0, y = 0.0;
    for (unsigned k = 0; k < count; ++k) {
        const double z = 1.0 - (2.0 * k + 1.0) / count, r = std::sqrt(std::max(0.0, 1.0 - z * z));
        directions.emplace_back(r * x, r * y, z);
        const double turned = x * kCos - y * kSin;
        y = x * kSin + y * kCos;
        x = turned;
    }
    return directions;
}

double reach_outside(const Sphere& s, const InsideTest& inside, bool solid, std::span<const Vec3> directions) {
    const double depth = solid ? -inside.signed_distance(s.centre) : 0.0;
    double reach = 0.0;
    const auto look = [&](const Vec3& direction) {
        const Vec3 p = s.centre + s.radius * direction;
        const auto hit = inside.tree().closest(p);
        if (hit && hit->distance > reach && (!solid || !inside.inside(p))) reach = hit->distance;
    };
    if (solid && s.radius <= depth) return 0.0;
    if (const auto hit = inside.tree().closest(s.centre); hit && hit->distance > 0.0) look((hit->point - s.centre) / hit->distance);
    for (const Vec3& direction : directions) look(direction);
    return reach;
}

} // namespace

double union_volume(std::span<const Sphere> balls, unsigned lines) {
    Box3 box;
    for (const Sphere& b : balls)
        if (b.radius >= 0.0) {
            box.add(Vec3(b.centre - Vec3::Constant(b.radius)));
            box.add(Vec3(b.centre + Vec3::Constant(b.radius)));
        }
    if (box.empty() || lines == 0) return 0.0;
    const double dx = box.extent()[0] / lines, dy = box.extent()[1] / lines;
    struct Span {
        unsigned line;
        double from, to;
    };
    std::vector<Span> spans;
    for (const Sphere& b : balls) {
        if (b.radius < 0.0) continue;
        const auto first = [&](double low, double step) { return std::max(0.0, std::ceil(low / step - 0.5)); };
        for (auto i = static_cast<unsigned>(first(b.centre[0] - b.radius - box.lo[0], dx)); i < lines; ++i) {
            const double x = box.lo[0] + (i + 0.5) * dx - b.centre[0];
            if (x > b.radius) break;
            for (auto j = static_cast<unsigned>(first(b.centre[1] - b.radius - box.lo[1], dy)); j < lines; ++j) {
                const double y = box.lo[1] + (j + 0.5) * dy - b.centre[1];
                if (y > b.radius) break;
                const double half_sq = b.radius * b.radius - x * x - y * y;
                if (half_sq <= 0.0) continue;
                const double half = std::sqrt(half_sq);
                spans.push_back({i * lines + j, b.centre[2] - half, b.centre[2] + half});
            }
        }
    }
    std::sort(spans.begin(), spans.end(), [](const Span& a, const Span& b) {
        return a.line != b.line ? a.line < b.line : a.from != b.from ? a.from < b.from : a.to < b.to;
    });
    double length = 0.0;
    for (std::size_t k = 0; k < spans.size();) {
        const unsigned line = spans[k].line;
        double end = spans[k].from;
        for (; k < spans.size() && spans[k].line == line; ++k) {
            if (spans[k].to <= end) continue;
            length += spans[k].to - std::max(end, spans[k].from);
            end = spans[k].to;
        }
    }
    return length * dx * dy;
}

TreeQuality measure_quality(const SphereTree& tree, const TriMesh& surface, bool solid, const QualityOptions& options) {
    TreeQuality quality;
    if (tree.sphere_count() == 0) return quality;
    const InsideTest inside(surface);
    const std::vector<Vec3> directions = spread_directions(options.directions);
    std::vector<Corners> triangles;
    double area = 0.0;
    for (const Triangle& t : surface.triangles) {
        triangles.push_back({surface.vertices[t[0]], surface.vertices[t[1]], surface.vertices[t[2]]});
        area += area_of(triangles.back());
    }
    CoverWalk walk(tree, options.finest * surface.bounds().longest_edge());
    for (std::size_t level = 0; level < tree.level_count(); ++level) {
        LevelQuality& q = quality.levels.emplace_back();
        double sum = 0.0;
        for (Index s = tree.level_begin[level]; s < tree.level_begin[level + 1]; ++s) {
            if (tree.spheres[s].radius < 0.0) continue;
            const double reach = reach_outside(tree.spheres[s], inside, solid, directions);
            q.outside_max = std::max(q.outside_max, reach);
            sum += reach;
            ++q.count;
        }
        q.outside_mean = q.count > 0 ? sum / static_cast<double>(q.count) : 0.0;
        double held = 0.0, reached = 0.0;
        for (const Corners& t : triangles) {
            held += walk.held(t, level, false);
            reached += walk.held(t, level, true);
        }
        q.uncovered = area > 0.0 ? std::max(0.0, 1.0 - held / area) : 0.0;
        q.reachable = area > 0.0 ? std::min(1.0, reached / area) : 1.0;
        if (q.uncovered < 1e-9) q.uncovered = 0.0; // rounding of two sums
        if (q.reachable > 1.0 - 1e-9) q.reachable = 1.0;
    }
    const std::size_t last = tree.level_count() - 1;
    const double volume = signed_volume(surface);
    if (solid && volume > 0.0)
        quality.volume_ratio =
            union_volume(std::span(tree.spheres).subspan(tree.level_begin[last], tree.level_begin[last + 1] - tree.level_begin[last]),
                         options.lines) /
            volume;
    return quality;
}

} // namespace trocar::spheretree
