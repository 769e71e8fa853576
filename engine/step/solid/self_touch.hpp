// Where a body's surface meets itself, beneath leaf spheres that lay apart at rest.
#pragma once

#include "engine/state/step_report.hpp"
#include "engine/step/solid/solid_scratch.hpp"

namespace trocar::engine {

/// Appends to solids.touches the vertices beneath these leaf pairs of one body that lie behind, or shortly before, a triangle
/// that faces them and whose leaf lay apart from theirs at rest; each vertex once, with the nearest such triangle. Which side is
/// out is the triangle's to say: a winding number does not know where a surface passes through itself. A vertex counts as behind
/// no deeper than its leaf's radius at rest, and not where it lay close behind at rest: that is the other side of the same flesh.
/// pairs   the first of a leaf that touched gets its gap
void touch_self(const SceneModel& model, const State& state, std::span<LeafPair> pairs, SolidScratch& solids, StepReport& report);

} // namespace trocar::engine
