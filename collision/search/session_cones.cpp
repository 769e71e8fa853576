#include "collision/search/session_cones.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace trocar::collision {
namespace {

/// Directions within `cosine` of the axis; a cosine of -1 holds all.
struct NormalCone {
    Vec3 axis = Vec3::UnitZ();
    double angle = -1.0; // rad; negative: nothing
};

constexpr double kWidest = 1.4; // rad, a quarter turn less a margin
constexpr double kAll = 3.2;    // rad, more than any

NormalCone cone_of(const Vec3& direction) noexcept {
    const double length = direction.norm();
    if (!(length > 0.0)) return {Vec3::UnitZ(), kAll}; // a degenerate triangle has any normal
    return {direction / length, 0.0};
}

/// Smallest cone with its axis half way between the two that holds both.
NormalCone merge(const NormalCone& a, const NormalCone& b) noexcept {
    if (a.angle < 0.0) return b;
    if (b.angle < 0.0) return a;
    if (a.angle >= kAll || b.angle >= kAll) return {a.axis, kAll};
    const Vec3 middle = a.axis + b.axis;
    const double length = middle.norm();
    if (!(length > 1e-9)) return {a.axis, kAll};
    const double apart = std::atan2(a.axis.cross(b.axis).norm(), a.axis.dot(b.axis));
    return {middle / length, 0.5 * apart + std::max(a.angle, b.angle)};
}

/// The normal of a triangle whose corners move linearly is quadratic in time: it stays in the hull of three vectors.
NormalCone cone_of_triangle(const Triangle& t, const SurfaceMotion& motion, std::span<const Index> vertex_of) noexcept {
    const auto edges = [&](std::span<const Vec3> x) {
        const Vec3& corner = x[vertex_of[t[0]]];
        return std::pair<Vec3, Vec3>(x[vertex_of[t[1]]] - corner, x[vertex_of[t[2]]] - corner);
    };
    const auto [a0, b0] = edges(motion.t0);
    const auto [a1, b1] = edges(motion.t1);
    return merge(merge(cone_of(a0.cross(b0)), cone_of(a1.cross(b1))), cone_of(a0.cross(b1) + a1.cross(b0)));
}

struct Finder {
    const SurfacePart& part;
    const SurfaceMotion& motion;
    std::span<Index> regions;
    Index next;

    NormalCone cone_of_cluster(Index cluster) const {
        NormalCone cone;
        const DopTree::BlockRange& faces = part.tree.clusters()[cluster].faces;
        for (Index i = 0; i < faces.count; ++i) {
            const Index face = part.tree.block_ids(faces.begin + i / DopTree::kLanes)[i % DopTree::kLanes];
            cone = merge(cone, cone_of_triangle(part.topology.triangles[face], motion, part.vertex_of));
        }
        return cone;
    }
    /// Cone of a node; where it is narrow all clusters beneath have one region.
    NormalCone visit(Index node) {
        const Index first = next;
        if ((node & DopTree::kLeafBit) != 0) {
            const Index cluster = node & ~DopTree::kLeafBit;
            const NormalCone cone = cone_of_cluster(cluster);
            regions[cluster] = cone.angle < kWidest ? next++ : kNoIndex;
            return cone;
        }
        NormalCone cone;
        for (const Index child : part.tree.children(node))
            if (child != DopTree::kNoChild) cone = merge(cone, visit(child));
        if (cone.angle >= kWidest) return cone;
        for (Index& region : regions)
            if (region != kNoIndex && region >= first) region = first;
        next = first + 1;
        return cone;
    }
};

} // namespace

Index find_flat_regions(const SurfacePart& part, const SurfaceMotion& motion, Index first, std::span<Index> regions) {
    assert(regions.size() == part.tree.clusters().size());
    std::fill(regions.begin(), regions.end(), kNoIndex);
    Finder finder{part, motion, regions, first};
    finder.visit(part.tree.root());
    return finder.next;
}

} // namespace trocar::collision
