// Static box tree over the triangles of a surface: built once, refitted when vertices move. It owns copies of the corners in
// leaf order, so that a query walks contiguous memory and nothing dangles when the mesh is moved or destroyed.
#pragma once

#include "base/box.hpp"
#include "base/closest_point.hpp"
#include "base/mesh.hpp"

#include <optional>
#include <span>
#include <vector>

namespace trocar {

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

    /// Allocates what follow() needs, and refits.
    /// loosest   of the mean extent of a triangle: parts that are open by more are fitted anew. With 1, few queries of each surface cost
    ///           least; with 0.1 many, which then enter hardly more leaves than of a fitted tree
    void start_following(std::span<const Vec3> vertices, double loosest = 1.0);
    /// The same as refit for a surface that changes little from call to call, at a fraction of the cost: boxes stay as they were, each part of
    /// the surface (some 200 triangles) moved and opened by how its vertices have moved since, and are renewed where they open: what moves
    /// as a whole opens none. Corners are read where they are: `vertices` must live until the next call of this or of refit. Same answers to
    /// every query, but that equally near points of closest() may be told apart by rounding. After start_following, or it refits; no allocation.
    void follow(std::span<const Vec3> vertices) noexcept;
    /// The same, but for parts that have opened: but for some, they stay open until renew_within says that there will be queries in them.
    void follow_loosely(std::span<const Vec3> vertices) noexcept;
    void renew_within(const Box3& box) noexcept;

    /// Nearest point of the surface within max_distance; of equally near triangles the one with the lowest id.
    /// Empty where nothing is that near, the tree is empty, or p is not finite.
    [[nodiscard]] std::optional<SurfacePoint> closest(const Vec3& p,
                                                      double max_distance = std::numeric_limits<double>::infinity()) const noexcept;

    /// Calls visit(triangle id) for every triangle whose own box overlaps the given one, in a fixed order.
    template <class Visit>
    void for_each_overlapping(const Box3& box, Visit&& visit) const {
        walk([&](const Box3& node) { return node.overlaps(box); }, [&](Index slot) { visit(order_[slot]); });
    }

    /// Prepares for for_each_overlapping_apart; to be called again after each build. Cost O(triangles).
    void find_common_vertices();
    /// As for_each_overlapping, of those triangles that share no vertex with the given one. Whole parts of the tree whose triangles
    /// all share one of its vertices are skipped: a fan of n triangles is compared with itself in O(n), not O(n^2).
    /// After find_common_vertices.
    template <class Visit>
    void for_each_overlapping_apart(const Box3& box, const Triangle& from, Visit&& visit) const {
        const auto shares = [&from](const Triangle& other) {
            for (const Index v : from)
                if (v == other[0] || v == other[1] || v == other[2]) return true;
            return false;
        };
        if (nodes_.empty()) return;
        std::array<Index, kMaxDepth> stack;
        std::size_t size = 0;
        stack[size++] = 0;
        while (size > 0) {
            const Index id = stack[--size];
            const Node& node = nodes_[id];
            if (shares(common_[id]) || !opened(node).overlaps(box)) continue;
            if (node.count == 0) {
                stack[size++] = node.first;
                stack[size++] = id + 1;
            } else {
                for (Index slot = node.first; slot < node.first + node.count; ++slot)
                    if (!shares(triangles_[slot]) && triangle_box(slot).overlaps(box)) visit(order_[slot]);
            }
        }
    }

    /// Does any triangle's own box overlap the given one?
    [[nodiscard]] bool overlaps_any(const Box3& box) const noexcept;

    /// Sum of the signs of the crossings of the ray from p along +axis or -axis: +1 where it leaves through a front face.
    /// Exact: all decisions are signs of exact predicates for a point shifted by infinitesimals, so edges and vertices on
    /// the ray count once. On a closed oriented surface this is p's winding number, whatever the direction.
    [[nodiscard]] int ray_crossings(const Vec3& p, int axis, bool positive) const noexcept;

    /// The same for each of some points near to each other, at less than the cost of as many rays.
    /// points, crossings   of the same length, at most kMaxPacket
    void ray_crossings(std::span<const Vec3> points, int axis, bool positive, std::span<int> crossings) const noexcept;
    static constexpr std::size_t kMaxPacket = 64;

    /// True if the same ray meets any triangle, from either side. Exact in the same sense.
    [[nodiscard]] bool ray_meets_any(const Vec3& p, int axis, bool positive) const noexcept;

    [[nodiscard]] bool empty() const noexcept { return order_.empty(); }
    [[nodiscard]] std::size_t triangle_count() const noexcept { return order_.size(); }
    /// Of all triangles, whatever it follows.
    [[nodiscard]] Box3 bounds() const noexcept { return nodes_.empty() ? Box3{} : box_now(0); }

private:
    struct Node {
        Box3 box;
        Index first = 0; // leaf: first slot; inner: right child (the left one follows its parent)
        Index count = 0; // leaf: slots; inner: 0
        Index part = 0;  // see Part
    };
    /// A part of the surface that a following tree opens and renews by itself. Nodes above the parts, which are fitted in every call, and all nodes
    /// of a tree that does not follow, have part 0, whose ways are none; what is beneath parts_[k] has part k + 1.
    struct Part {
        Index node_begin = 0, node_end = 0;     // the topmost one first
        Index vertex_begin = 0, vertex_end = 0; // of part_vertex_ and fitted_
    };
    static constexpr std::size_t kPartSize = 256; // triangles at most of a part
    static constexpr Index kLeafSize = 4;        // triangles per leaf: a box test costs about a quarter of a triangle test
    static constexpr std::size_t kMaxDepth = 64; // median splits halve: 2^32 triangles need 32 levels

    /// visit(+1 or -1 as above) for each triangle on the ray; stops once it returns false.
    template <class Visit>
    void walk_ray(const Vec3& p, int axis, bool positive, Visit&& visit) const noexcept;
    /// +1 or -1 where the ray crosses the slot's triangle, 0 where it does not.
    [[nodiscard]] int crossing(Index slot, const Vec3& p, int axis, bool positive) const noexcept;

    Index build_node(std::span<Index> slots, std::span<const Vec3> centres, Index first);
    /// Children lie behind their parent. corners_of(slot): 3 corners, m, called once for each slot of the leaves
    template <class CornersOf>
    static void fit_boxes(std::span<Node> nodes, std::size_t from, std::size_t to, CornersOf&& corners_of) noexcept {
        for (std::size_t id = to; id-- > from;) {
            Node& node = nodes[id];
            Box3 box; // a local one stays in registers
            if (node.count == 0) {
                box = nodes[id + 1].box;
                box.add(nodes[node.first].box);
            }
            for (Index slot = node.first; slot < node.first + node.count; ++slot)
                for (const Vec3& corner : corners_of(slot)) box.add(corner);
            node.box = box;
        }
    }

    template <class Enter, class Leaf>
    void walk(Enter&& enter, Leaf&& leaf) const {
        if (nodes_.empty()) return;
        std::array<Index, kMaxDepth> stack;
        std::size_t size = 0;
        stack[size++] = 0;
        while (size > 0) {
            const Index id = stack[--size];
            const Node& node = nodes_[id];
            if (!enter(opened(node))) continue;
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
        for (const Vec3& corner : corners_at(slot)) box.add(corner);
        return box;
    }
    [[nodiscard]] std::array<Vec3, 3> corners_at(Index slot) const noexcept {
        if (now_.empty()) return corners_[slot];
        const Triangle& t = triangles_[slot];
        return {now_[t[0]], now_[t[1]], now_[t[2]]};
    }
    [[nodiscard]] Box3 opened(const Node& node) const noexcept {
        const Box3& ways = ways_[node.part];
        return {node.box.lo + ways.lo, node.box.hi + ways.hi};
    }
    /// Of what is above the parts, or the topmost of one.
    [[nodiscard]] Box3 box_now(Index id) const noexcept {
        const Node& node = nodes_[id];
        return node.part == 0 || now_.empty() ? node.box : part_box_[node.part];
    }
    /// Finds the part's ways and its box as it is now.
    void look_at(const Part& part, Box3& ways, Box3& box) const noexcept;
    /// Fits the part's boxes to where its vertices are now.
    void renew(const Part& part, Box3& ways) noexcept;
    void find_ways(std::span<const Vec3> vertices) noexcept;
    void renew_early() noexcept;

    std::vector<Node> nodes_;                  // depth-first, root first
    std::vector<Triangle> common_;             // [node] vertices of all triangles beneath, the rest kNoIndex; empty unless asked for
    std::vector<Index> order_;                 // [slot] triangle id
    std::vector<Triangle> triangles_;          // [slot] vertex ids, kept for refits
    std::vector<std::array<Vec3, 3>> corners_; // [slot] m, unless it follows

    // A tree that follows: what is beneath a part holds the surface as it was at fitted_.
    std::span<const Vec3> now_;       // [vertex] m, where corners are read; empty: from corners_
    std::size_t vertex_count_ = 0;    // of those it follows
    std::vector<Part> parts_;
    std::vector<Box3> ways_;          // [1 + parts] m, by which nodes are moved and opened
    std::vector<Box3> part_box_;      // [1 + parts] m, of now_
    std::vector<Index> part_vertex_;  // each once in a part
    std::vector<Vec3> fitted_;        // [part_vertex_] m
    std::vector<Index> above_;        // nodes above the parts, children first
    double loosest_ = 0.0;            // m, opening at which a part is fitted anew
    std::size_t next_ = 0;            // part that is the first to be renewed early
};

} // namespace trocar
