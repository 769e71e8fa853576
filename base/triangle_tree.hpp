// Static box tree over the triangles of a surface: built once, refitted when vertices move. It owns copies of the corners in
// leaf order, so that a query walks contiguous memory and nothing dangles when the mesh moves house.
#pragma once

#include "base/box.hpp"
#include "base/closest_point.hpp"
#include "base/mesh.hpp"

#include <optional>
#include <span>
#include <vector>

namespace seldinger {

struct SurfacePoint {
    Index triangle = kNoIndex;                 // id in the mesh that the tree was built over
    Vec3 point = Vec3::Zero();                 // m
    std::array<double, 3> bary{1.0, 0.0, 0.0}; // weights of the triangle's corners
    double distance = 0.0;                     // m, not negative
};

class TriangleTree {
public:
    TriangleTree() = default;
    explicit TriangleTree(const TriMesh& mesh) { build(mesh.vertices, mesh.triangles); }

    /// Median split of the longest axis of the centres; ties by triangle id, so the tree depends on the mesh alone.
    void build(std::span<const Vec3> vertices, std::span<const Triangle> triangles);

    /// New positions of the same vertices. No allocation. Cost O(triangles).
    void refit(std::span<const Vec3> vertices) noexcept;

    /// Nearest point of the surface within max_distance; of equally near triangles the one with the lowest id.
    /// Empty where nothing is that near, the tree is empty, or p is not finite.
    [[nodiscard]] std::optional<SurfacePoint> closest(const Vec3& p,
                                                      double max_distance = std::numeric_limits<double>::infinity()) const noexcept;

    /// Calls visit(triangle id) for every triangle whose own box overlaps the given one, in a fixed order.
    template <class Visit>
    void for_each_overlapping(const Box3& box, Visit&& visit) const {
        walk([&](const Box3& node) { return node.overlaps(box); }, [&](Index slot) { visit(order_[slot]); });
    }

    /// Sum of the signs of the crossings of the ray from p along +axis or -axis: +1 where it leaves through a front face.
    /// Exact: all decisions are signs of exact predicates for a point shifted by infinitesimals, so edges and vertices on
    /// the ray count once. On a closed oriented surface this is p's winding number, whatever the direction.
    [[nodiscard]] int ray_crossings(const Vec3& p, int axis, bool positive) const noexcept;

    /// True if the same ray meets any triangle, from either side. Exact in the same sense.
    [[nodiscard]] bool ray_meets_any(const Vec3& p, int axis, bool positive) const noexcept;

    [[nodiscard]] bool empty() const noexcept { return order_.empty(); }
    [[nodiscard]] std::size_t triangle_count() const noexcept { return order_.size(); }
    [[nodiscard]] Box3 bounds() const noexcept { return nodes_.empty() ? Box3{} : nodes_.front().box; }

private:
    struct Node {
        Box3 box;
        Index first = 0; // leaf: first slot; inner: right child (the left one follows its parent)
        Index count = 0; // leaf: slots; inner: 0
    };
    static constexpr Index kLeafSize = 4;        // triangles per leaf: a box test costs about a quarter of a triangle test
    static constexpr std::size_t kMaxDepth = 64; // median splits halve: 2^32 triangles need 32 levels

    /// visit(+1 or -1 as above) for each triangle on the ray; stops once it returns false.
    template <class Visit>
    void walk_ray(const Vec3& p, int axis, bool positive, Visit&& visit) const noexcept;

    Index build_node(std::span<Index> slots, std::span<const Vec3> centres, Index first);
    void fit_leaf(Node& node) const noexcept;

    template <class Enter, class Leaf>
    void walk(Enter&& enter, Leaf&& leaf) const {
        if (nodes_.empty()) return;
        std::array<Index, kMaxDepth> stack;
        std::size_t size = 0;
        stack[size++] = 0;
        while (size > 0) {
            const Index id = stack[--size];
            const Node& node = nodes_[id];
            if (!enter(node.box)) continue;
            if (node.count > 0) {
                for (Index slot = node.first; slot < node.first + node.count; ++slot)
                    if (enter(triangle_box(slot))) leaf(slot);
            } else {
                stack[size++] = node.first;
                stack[size++] = id + 1;
            }
        }
    }
    [[nodiscard]] Box3 triangle_box(Index slot) const noexcept {
        Box3 box;
        for (const Vec3& corner : corners_[slot]) box.add(corner);
        return box;
    }

    std::vector<Node> nodes_;                  // depth-first, root first
    std::vector<Index> order_;                 // [slot] triangle id
    std::vector<Triangle> triangles_;          // [slot] vertex ids, kept for refits
    std::vector<std::array<Vec3, 3>> corners_; // [slot] m
};

} // namespace seldinger
