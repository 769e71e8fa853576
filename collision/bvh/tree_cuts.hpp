// How the triangles of a node are distributed to its children, by each of the builders: what every hierarchy over a surface shares.
// source   Klosowski et al. 1998; Mezger, Kimmerle, Etzmuss 2003, section 4.2 (Middle); Wald 2007 (Sah).
#pragma once

#include "base/box.hpp"
#include "collision/bvh/dop.hpp"
#include "collision/bvh/tree_options.hpp"

#include <array>
#include <span>
#include <vector>

namespace trocar::collision {

/// One triangle while a tree is built.
struct CutItem {
    Vec3 centre = Vec3::Zero(); // m; 0 where it is not finite: an order needs comparable numbers
    Box3 box;
};
[[nodiscard]] std::vector<CutItem> make_cut_items(std::span<const Triangle> triangles, std::span<const Vec3> positions);

struct CutPlan {
    std::span<const CutItem> items;      // [triangle_count]
    std::span<const Triangle> triangles; // [triangle_count]
    std::span<const Vec3> positions;     // [vertex_count] m
    Directions directions;
    TreeBuilder builder;
};

/// Consecutive parts of a span of triangle ids; the first `count` are in use, none of them empty.
struct CutParts {
    std::array<std::span<Index>, 8> part;
    std::size_t count = 0;
};
/// Cuts the largest part until there are `arity` of them, or none has more than leaf_size triangles.
/// order   triangle ids, at least one; reordered
[[nodiscard]] CutParts cut_into_parts(const CutPlan& plan, std::span<Index> order, std::size_t arity, std::size_t leaf_size);

} // namespace trocar::collision
