// Tree over a row of spheres that moves every step: a catheter or a needle. The leaves sweep their link from t0 to t1, so a
// fast instrument cannot jump a wall between two instants.
#pragma once

#include "spheretree/sphere_tree.hpp"

namespace trocar::spheretree {

/// Result of the last descent through a lumen for a link (or, while it is open, about a group of links).
enum class LinkStatus : std::uint8_t {
    Open,    // the budget ended first: assumed in contact
    Free,    // proven: over the whole step inside one inscribed sphere, including the margin
    Contact, // closer to the wall than the margin, or outside
};

/// Shape of the tree for up to `capacity` links: built once. Link i is the item of the i-th leaf.
struct ChainTree {
    SphereTree tree;
    [[nodiscard]] std::size_t capacity() const noexcept { return tree.items.size(); }
    [[nodiscard]] Index leaf_of_link(Index link) const noexcept { return tree.level_begin[tree.level_count() - 1] + link; }
    [[nodiscard]] Index link_of_leaf(Index leaf) const noexcept { return tree.item_begin[leaf]; }
};

/// The chain in this step, and the hints left by the last one.
struct ChainState {
    std::vector<Sphere> spheres;  // [sphere_count] swept bounds; empty where no link is active
    std::vector<Sphere> links_t0; // [active links]
    std::vector<Sphere> links_t1; // [active links]
    std::vector<Index> hint;      // [capacity] lumen leaf that answered last, kNoIndex: none. Changes the work, not the result
};

/// All leaves lie on the last level.
[[nodiscard]] ChainTree make_chain_tree(std::size_t capacity, unsigned branching = 8);

/// links_t0/_t1  [active] the links at both ends of the step, active <= capacity. Number links so that the ones that come
///               and go (at the entry port) are the last: hints then stay with their link.
/// cost      O(active), no allocation after the first call with as many links
void update_chain(const ChainTree& chain, std::span<const Sphere> links_t0, std::span<const Sphere> links_t1, ChainState& state);

} // namespace trocar::spheretree
