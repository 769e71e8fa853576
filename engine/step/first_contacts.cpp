#include "engine/step/first_contacts.hpp"

#include "engine/step/solid/solid_stage.hpp"
#include "engine/step/solid/solid_trees.hpp"
#include "engine/step/stages.hpp"
#include "engine/step/tissue/tissue_stage.hpp"
#include "engine/time/clock.hpp"
#include "engine/time/step_budget.hpp"

namespace trocar::engine {

void find_first_contacts(const SceneModel& model, State& state, StepScratch& scratch) {
    if (!model.effects.coarse_contact) return;
    const MonotonicClock clock; // nothing depends on it: the budget has no bound
    StepBudget budget(clock, {.mode = BudgetMode::Exact});
    StepReport report;
    keep_start(model, state, scratch.bodies, scratch.solids, scratch.rods);
    keep_surfaces(model, state, scratch.bodies);
    share_start(model, scratch.bodies, scratch.solids, scratch.rods);
    update_solid_trees(model, state, model.effects.gravity, scratch.solids, true);
    spheretree::Descent& descent = scratch.traversal.descent;
    descent.begin(model.contact.margin);
    add_solid_pairs(model, scratch.solids, descent, report);
    if (!descent.has_solids()) return;
    WorkBudget all;
    (void)descent.run(all);
    scratch.traversal.coarse.clear();
    descent.add_contacts(scratch.traversal.coarse);
    scratch.solids.coarse = scratch.traversal.coarse;
    push_solids(model, state, scratch.solids, report, budget);
}

} // namespace trocar::engine
