// Is a point inside a closed surface? By its winding number, counted exactly along one ray.
#pragma once

#include "base/triangle_tree.hpp"

namespace trocar {

/// Nonzero rule: where outward shells overlap they count as one body; inside an inward shell nested in an outward one
/// (a cavity) a point is outside. The surface must be closed and consistently oriented; on an open one the answer depends
/// on the ray, which goes along an axis to the nearest side of the bounding box.
/// Points exactly on the surface get one of the two answers, always the same one.
class InsideTest {
public:
    InsideTest() = default;
    explicit InsideTest(const TriMesh& closed_surface) : tree_(closed_surface) {}

    /// New positions of the same vertices. No allocation.
    void refit(std::span<const Vec3> vertices) noexcept { tree_.refit(vertices); }

    /// See TriangleTree.
    void start_following(std::span<const Vec3> vertices, double loosest = 1.0) { tree_.start_following(vertices, loosest); }
    void follow(std::span<const Vec3> vertices) noexcept { tree_.follow(vertices); }
    void follow_loosely(std::span<const Vec3> vertices) noexcept { tree_.follow_loosely(vertices); }
    void renew_within(const Box3& box) noexcept { tree_.renew_within(box); }

    /// How often the surface winds around p; 0 outside, and for a p that is not finite.
    [[nodiscard]] int winding_number(const Vec3& p) const noexcept;
    [[nodiscard]] bool inside(const Vec3& p) const noexcept { return winding_number(p) != 0; }

    /// How many of the points are outside. Points that are near each other should be adjacent in the array: they share a traversal.
    [[nodiscard]] std::size_t count_outside(std::span<const Vec3> points) const noexcept;

    /// Distance to the surface, negative inside. Infinity for an empty surface or a p that is not finite.
    [[nodiscard]] double signed_distance(const Vec3& p) const noexcept;

    [[nodiscard]] const TriangleTree& tree() const noexcept { return tree_; }

private:
    TriangleTree tree_;
};

} // namespace trocar
