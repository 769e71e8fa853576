// Walls that are joined to organs, in a step: which bodies are advanced together, and what their ties do (engine/prepare/wall_ties.hpp).
#pragma once

#include "engine/state/state.hpp"
#include "engine/step/tissue/tissue_scratch.hpp"

namespace trocar::engine {

/// Ties between bodies of an island, or of a group without contact: places in `members`, ascending.
void list_ties(const SceneModel& model, std::span<const std::size_t> members, std::vector<fem::TiedBodies>& ties);

/// v += h a of all these ties, where the nodes stand.
void kick_ties(std::span<const fem::TiedBodies> ties, double h, std::span<fem::TissueLockstep> bodies) noexcept;

/// J, of all of the model's.
[[nodiscard]] double tie_energy(const SceneModel& model, const State& state) noexcept;

} // namespace trocar::engine
