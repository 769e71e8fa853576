// Springs between solids that nothing presses yet are left out of a body's integration until it is known that something will touch it.
//
// A spring stands against the other body as it was when the step began, and a step's stable length counts every spring: a body would feel
// what only comes near it. So a body none of whose solids' springs is pressed is integrated without them first. If then no two
// places have met, that is the step: to the bit what it is without contact. Otherwise the body is put back and integrated with them.
#pragma once

#include "engine/step/tissue/tissue_scratch.hpp"

namespace trocar::engine {

/// Decides whether the springs of a body's solid contacts wait in this step, and lists those that do not (TissueScratch::other_springs).
void choose_springs(const SceneModel& model, std::size_t body, const State& state, TissueScratch& scratch);

/// What the body's integration feels.
[[nodiscard]] const fem::ContactSprings& active_springs(const BodyState& state, const TissueScratch& scratch) noexcept;

/// Of a body whose springs wait: would one of them be pressed at the end of the step, as all bodies stand now? Every body was integrated.
[[nodiscard]] bool has_met(const SceneModel& model, std::size_t body, const State& state) noexcept;

} // namespace trocar::engine
