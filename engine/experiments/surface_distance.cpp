#include "engine/experiments/surface_distance.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace trocar::engine {

namespace {

/// A vertex whose position differs in the other state, and by how much, m.
struct Moved {
    Index vertex = 0;
    double distance = 0.0;
};

void add_one_way(const std::vector<Moved>& moved, std::span<const Vec3> from, const TriangleTree& to, SurfaceDistance& distance) {
    for (const auto& [vertex, farthest] : moved) {
        const auto hit = to.closest(from[vertex], farthest * (1.0 + 1e-12));
        const double away = hit ? std::min(hit->distance, farthest) : farthest;
        distance.sum_sq += away * away;
        distance.hausdorff = std::max(distance.hausdorff, away);
    }
}

} // namespace

void SurfaceDistance::join(const SurfaceDistance& other) noexcept {
    sum_sq += other.sum_sq;
    vertices += other.vertices;
    hausdorff = std::max(hausdorff, other.hausdorff);
}

/// A mean is no larger than the largest, but for the rounding of its sum.
double SurfaceDistance::rms() const noexcept {
    return vertices > 0 ? std::min(std::sqrt(sum_sq / static_cast<double>(vertices)), hausdorff) : 0.0;
}

SurfaceDistance measure_distance(std::span<const Triangle> triangles, std::span<const Vec3> a, std::span<const Vec3> b) {
    SurfaceDistance distance;
    distance.vertices = 2 * a.size();
    std::vector<Moved> moved;
    for (Index v = 0; v < a.size(); ++v) {
        const double sq = (a[v] - b[v]).squaredNorm();
        if (!std::isfinite(sq)) {
            distance.sum_sq = distance.hausdorff = std::numeric_limits<double>::infinity();
            return distance;
        }
        if (sq > 0.0) moved.push_back({v, std::sqrt(sq)});
    }
    if (moved.empty()) return distance;
    TriangleTree tree;
    tree.build(b, triangles);
    add_one_way(moved, a, tree, distance);
    tree.refit(a);
    add_one_way(moved, b, tree, distance);
    return distance;
}

} // namespace trocar::engine
