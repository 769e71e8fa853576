// Contact response: rods between the planes of their walls, what of the motion is safe, and the list of what touches.
#pragma once

#include "engine/state/state.hpp"
#include "engine/state/step_report.hpp"
#include "engine/step/instrument/instrument_scratch.hpp"
#include "engine/step/tissue/tissue_scratch.hpp"
#include "engine/time/step_budget.hpp"

#include <span>
#include <vector>

namespace trocar::engine {

/// Instruments against their walls where no exact answer stands, what of the step's motion is free of contact, and the walls' share of what
/// the rods press with. A rod that is not finite stops the run before its state is taken over.
void resolve_instruments(const SceneModel& model, const EffectSet& live, State& state, BodiesScratch& bodies, RodsScratch& rods,
                         StepReport& report, StepBudget& budget);

/// A rod that was not proven to stay out of itself all the way takes the share of its motion that is. Returns whether one did.
[[nodiscard]] bool hold_rods(const SceneModel& model, State& state, RodsScratch& rods, StepReport& report);

/// Up to which share of the motion as it is does no skin come nearer to its wall than `distance`, m?
[[nodiscard]] double find_free_share(const SceneModel& model, double distance, const State& state, RodsScratch& rods);

/// Bodies and rods take the share of the step's motion that is proven free, or as much of it as is.
void scale_to_safe_fraction(const SceneModel& model, const EffectSet& live, double fraction, State& state, BodiesScratch& bodies,
                            RodsScratch& rods, StepReport& report);

/// What the step's response pushed against: presses of instruments, touches of solids, and sphere contacts of those without a surface's depth.
/// coarse    of the traversal
void list_contacts(const SceneModel& model, const State& state, const RodsScratch& rods, std::span<const Contact> coarse, StepReport& report,
                   std::vector<Contact>& contacts);

} // namespace trocar::engine
