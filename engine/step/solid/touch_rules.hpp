// What counts as a touch between surfaces.
#pragma once

#include "base/contact.hpp"
#include "engine/prepare/model.hpp"

#include <span>
#include <utility>

namespace trocar::engine {

/// Cosine. A place whose own surface looks another way than at what it meets is not about to meet it: a table's vertex before
/// the edge of a block that slides over it is nearest to the block's side, and will pass beneath; sheets that meet look at each other.
inline constexpr double kFacing = -0.2;
/// Cosine of two faces of a body that look away from each other: what lies behind the second is past the body's middle.
inline constexpr double kFarSide = -0.5;

/// m; nearer than this the way to the closest point is rounding, and the triangle's normal says which way is out.
inline constexpr double kNoWay = 1e-9;

/// m; paths that come no nearer than this touch nothing.
inline constexpr double kOnSurface = 1e-9;

/// Do the two surfaces touch there at the step's end, or have they pressed on one another in it?
[[nodiscard]] inline bool is_touching(const Contact& touch) noexcept { return touch.gap <= 0.0 || !touch.force.isZero(0.0); }

/// Orders what has a key().
inline constexpr auto kByKey = [](const auto& x, const auto& y) { return x.key() < y.key(); };

[[nodiscard]] inline std::pair<Index, Index> bodies_of(const Contact& contact) noexcept {
    return {static_cast<Index>(contact.a.index()), static_cast<Index>(contact.b.index())};
}

/// visit(begin, end) of the traversal's contacts of each two bodies, which lie side by side.
template <class Visit>
void for_each_two_bodies(std::span<const Contact> coarse, Visit&& visit) {
    for (Index begin = 0, end = 0; begin < coarse.size(); begin = end) {
        while (end < coarse.size() && bodies_of(coarse[end]) == bodies_of(coarse[begin])) ++end;
        visit(begin, end);
    }
}

/// A pair of spheres with nothing left to refine, tested, or assumed and overlapping.
[[nodiscard]] bool is_leaf_pair(const SceneModel& model, const Contact& contact) noexcept;

} // namespace trocar::engine
