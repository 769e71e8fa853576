#include "engine/observe/surface_distance.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace seldinger::engine {

namespace {

/// Largest distance of a vertex of `from` to the other surface, at least `known`.
double one_way(const std::vector<std::pair<double, Index>>& by_displacement, std::span<const Vec3> from, const TriangleTree& to,
               double known) {
    for (const auto& [displacement, v] : by_displacement) {
        if (displacement <= known) break;
        const auto hit = to.closest(from[v], displacement * (1.0 + 1e-12));
        known = std::max(known, hit ? std::min(hit->distance, displacement) : displacement);
    }
    return known;
}

} // namespace

void SurfaceDistance::join(const SurfaceDistance& other) noexcept {
    sum_sq += other.sum_sq;
    vertices += other.vertices;
    hausdorff = std::max(hausdorff, other.hausdorff);
}

double SurfaceDistance::rms() const noexcept { return vertices > 0 ? std::sqrt(sum_sq / static_cast<double>(vertices)) : 0.0; }

SurfaceDistance measure_distance(std::span<const Triangle> triangles, std::span<const Vec3> a, std::span<const Vec3> b) {
    SurfaceDistance distance;
    distance.vertices = a.size();
    std::vector<std::pair<double, Index>> moved; // displacement, vertex
    for (Index v = 0; v < a.size(); ++v) {
        const double sq = (a[v] - b[v]).squaredNorm();
        if (!std::isfinite(sq)) {
            distance.sum_sq = distance.hausdorff = std::numeric_limits<double>::infinity();
            return distance;
        }
        distance.sum_sq += sq;
        if (sq > 0.0) moved.emplace_back(std::sqrt(sq), v);
    }
    if (moved.empty()) return distance;
    std::sort(moved.begin(), moved.end(),
              [](const auto& x, const auto& y) { return x.first != y.first ? x.first > y.first : x.second < y.second; });
    TriangleTree tree;
    tree.build(b, triangles);
    distance.hausdorff = one_way(moved, a, tree, 0.0);
    tree.refit(a);
    distance.hausdorff = one_way(moved, b, tree, distance.hausdorff);
    return distance;
}

} // namespace seldinger::engine
