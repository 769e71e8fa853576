// A tree of spheres as flat arrays: level order, children contiguous, so that a breadth-first pass walks forward through
// memory. The same layout serves three trees: covering trees of solids, lumen trees of hollow bodies, chains of instruments.
#pragma once

#include "base/vec.hpp"

#include <algorithm>
#include <span>
#include <vector>

namespace trocar::spheretree {

struct Sphere {
    Vec3 centre = Vec3::Zero(); // m
    double radius = -1.0;       // m; negative: empty, contains and touches nothing
};

/// Built once, then only read. Sphere 0 is the root. A leaf may lie at any level.
struct SphereTree {
    std::vector<Sphere> spheres;            // [sphere_count] m, rest pose
    std::vector<Index> parent;              // [sphere_count] kNoIndex at the root
    std::vector<Index> first_child;         // [sphere_count] kNoIndex at leaves
    std::vector<std::uint16_t> child_count; // [sphere_count] 0 at leaves
    std::vector<std::uint8_t> level;        // [sphere_count] 0 at the root
    std::vector<Index> level_begin;         // [level_count + 1] first sphere of each level
    std::vector<Index> items;               // [item_count] triangle, lumen ball or chain link ids, depth-first order
    std::vector<Index> item_begin;          // [sphere_count] items beneath a sphere: items[item_begin .. item_end)
    std::vector<Index> item_end;            // [sphere_count]

    [[nodiscard]] std::size_t sphere_count() const noexcept { return spheres.size(); }
    [[nodiscard]] std::size_t level_count() const noexcept { return level_begin.empty() ? 0 : level_begin.size() - 1; }
    [[nodiscard]] int leaf_depth() const noexcept { return std::max(0, static_cast<int>(level_count()) - 1); }
    [[nodiscard]] bool is_leaf(Index sphere) const noexcept { return child_count[sphere] == 0; }
    [[nodiscard]] std::span<const Index> items_of(Index sphere) const noexcept {
        return std::span(items).subspan(item_begin[sphere], item_end[sphere] - item_begin[sphere]);
    }
};

} // namespace trocar::spheretree
