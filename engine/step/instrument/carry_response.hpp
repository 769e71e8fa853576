// Instruments between their walls where there is no time for it: what a step of a small budget does instead of planes for every place and a solve
// between them.
//
// The step ends where the rod looked ahead to, between planes of earlier steps that have gone along with their walls. Planes of as many places as there is
// time for are made anew, for the next step's look ahead: those first that have come nearest to what their planes do not tell of. Where one has come there,
// nothing proves the way free: the drive goes no farther in and does not turn until there is time for it.
#pragma once

#include "engine/step/instrument/instrument_scratch.hpp"
#include "engine/time/step_budget.hpp"

namespace trocar::engine {

/// False: a place is found in its wall, and the step has to be answered in whole.
[[nodiscard]] bool carry_response(const SceneModel& model, std::size_t instrument, State& state, RodsScratch& rods, StepReport& report, StepBudget& budget);

/// After the step's last motion: what each place has left of what its planes tell. Without a limit of time nothing is carried, and nobody asks.
void spend_known(const SceneModel& model, State& state, const RodsScratch& rods, bool is_limited, StepReport& report);

/// May the drive go on by so much, m?
[[nodiscard]] bool is_way_known(const SceneModel& model, std::size_t instrument, const State& state, double advance) noexcept;

} // namespace trocar::engine
