// Contact between solid bodies: sphere trees under the budget, and penalty springs on the coarse nodes of those that deform.
#pragma once

#include "engine/step/context.hpp"

namespace seldinger::engine {

/// Can these two bodies touch? Both are solid, one moves, and neither carries the other: those are one body.
[[nodiscard]] bool are_solid_pair(const SceneModel& model, std::size_t i, std::size_t j) noexcept;

/// Sphere trees of solid bodies follow their surfaces over the step.
void update_solid_trees(const SceneModel& model, const State& state, StepContext& context);

/// Adds every pair of solid bodies that can touch to the descent.
void add_solid_pairs(const SceneModel& model, StepContext& context);

/// Contacts of solid pairs in context.coarse become springs, the deepest per sphere. Assumed ones are capped in depth.
/// source   seed 003, section 4: forces on the coarse vertices linked to the spheres. Deviates: springs are evaluated in
///          every stage of the integration, and one sphere gives one spring instead of an average over its pairs.
void push_solids(const SceneModel& model, const State& state, StepContext& context);

} // namespace seldinger::engine
