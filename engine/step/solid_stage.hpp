// Contact between solid bodies: sphere trees under the budget, and penalty springs on the coarse nodes of those that deform.
#pragma once

#include "engine/step/context.hpp"

namespace seldinger::engine {

/// Adds every pair of solid bodies of which one moves to the descent. A carrier and what it carries are one body.
void add_solid_pairs(const SceneModel& model, const State& state, StepContext& context);

/// Contacts of solid pairs in context.coarse become springs, the deepest per sphere. Assumed ones are capped in depth.
/// source   seed 003, section 4: forces on the coarse vertices linked to the spheres. Deviates: springs are evaluated in
///          every stage of the integration, and one sphere gives one spring instead of an average over its pairs.
void push_solids(const SceneModel& model, const State& state, StepContext& context);

} // namespace seldinger::engine
