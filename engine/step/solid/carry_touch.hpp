// A place that pushed, followed to where its surfaces are now without a search: what stands for a pair of surfaces that the budget leaves.
#pragma once

#include "engine/step/solid/solid_passage.hpp"

namespace trocar::engine {

/// The place of `touch` on the first body against what is nearest to it on the second among the triangles around the one it met, walked from
/// neighbour to neighbour; deep places keep the triangle and the normal that they had. Nothing: it neither pressed nor is near any more.
/// way    from the first body to the second
/// cost   independent of the surfaces' size: no tree is refitted. What the place has not met yet goes unseen.
[[nodiscard]] std::optional<Contact> carry_touch(const OneWay& way, const Contact& touch);

} // namespace trocar::engine
