// Shapes of trees: which items lie beneath which sphere. The spheres themselves are fitted by the caller.
#pragma once

#include "spheretree/sphere_tree.hpp"

namespace trocar::spheretree {

/// Groups items by halving at the median of the longest axis, log2(branching) times a level; ties by item id, so the tree
/// depends on the centres alone. Spheres are left empty.
/// centres    [item_count] m, finite      branching  rounded down to 2, 4 or 8
[[nodiscard]] SphereTree split_by_median(std::span<const Vec3> centres, unsigned branching, std::size_t leaf_items);

/// Groups `item_count` items in their order, `branching` at a time, from the last level up.
[[nodiscard]] SphereTree split_in_order(std::size_t item_count, unsigned branching);

} // namespace trocar::spheretree
