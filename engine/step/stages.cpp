#include "engine/step/stages.hpp"

#include "engine/step/instrument/instrument_stage.hpp"
#include "engine/step/instrument/wall_exchange.hpp"
#include "engine/step/solid/solid_trees.hpp"
#include "engine/step/tissue/pull_stage.hpp"
#include "engine/step/tissue/tissue_stage.hpp"
#include "engine/prepare/body_pairs.hpp"
#include "engine/time/account.hpp"
#include "engine/time/phase.hpp"

namespace trocar::engine {

void share_start(const SceneModel& model, const BodiesScratch& bodies, SolidScratch& solids, RodsScratch& rods) {
    for (std::size_t i = 0; i < model.bodies.size(); ++i) {
        rods.walls[i].surface_t0 = solids.bodies[i].surface_t0 = bodies.start[i].surface;
        solids.bodies[i].nodes_t0 = bodies.start[owner_of(model, i)].tissue.position;
    }
}

void find_live_effects(const SceneModel& model, const LiveEffects& live, EffectSet& effects) {
    effects = model.effects; // lists of the same sizes: copies, does not allocate
    for (const EffectDescriptor* effect : registered_effects())
        if (const double share = live.share(*effect); share < 1.0 && effect->scale != nullptr) effect->scale(effects, share);
}

StepReport& start_report(const SceneModel& model, const State& state, StepReport& report) {
    report = StepReport{};
    report.step = state.step + 1;
    const bool even = state.time == static_cast<double>(state.step) * model.step_s; // else it comes from a model with other steps
    report.time_s = even ? static_cast<double>(report.step) * model.step_s : state.time + model.step_s;
    return report;
}

unsigned choose_drops(const SceneModel& model, StepBudget& budget, StepReport& report) {
    budget.begin(model.budget_covers_step);
    report.dropped = model.budget_covers_step ? budget.choose_drops(model.drop) : 0u;
    return report.dropped;
}

void keep_start(const SceneModel& model, State& state, BodiesScratch& bodies, SolidScratch& solids, RodsScratch& rods) {
    keep_bodies(model, state, bodies);
    keep_turns(model, state, solids);
    keep_instruments(model, state, rods);
    solids.forces_t0.clear();
    for (const SolidContact& place : state.solids.contacts) solids.forces_t0.push_back({place.touch.force, place.warm});
    bodies.effects_t0 = state.effects; // of the same sizes: copies, does not allocate
}

void restore_start(const SceneModel& model, State& state, const BodiesScratch& bodies, const SolidScratch& solids, const RodsScratch& rods) {
    restore_bodies(model, state, bodies);
    restore_instruments(model, state, rods);
    for (std::size_t k = 0; k < solids.forces_t0.size(); ++k) // a step that fails has not listed others
        state.solids.contacts[k].touch.force = solids.forces_t0[k].force, state.solids.contacts[k].warm = solids.forces_t0[k].warm;
    state.effects = bodies.effects_t0;
    for (BodyState& body : state.bodies) {
        if (body.lumen_step != state.step) continue;
        body.lumen.miss_steps(); // it has seen where the step would have ended
        body.lumen_step = kNoStep;
    }
}

/// Does the budget leave the tissue's motion in this step?
static bool takes_tissue(unsigned dropped) noexcept { return (dropped & drop_bit(Droppable::Elasticity)) == 0; }

void apply_inputs(const SceneModel& model, const EffectSet& live, unsigned dropped, const Inputs& inputs, State& state, BodiesScratch& bodies,
                  RodsScratch& rods, StepReport& report) {
    for (TissueScratch& tissue : bodies.tissue) tissue.contact.clear();
    apply_drive_commands(model, inputs.drive, state, rods, report);
    if (!inputs.pull || !live.elasticity || !takes_tissue(dropped)) return;
    place_surface(model, inputs.pull->body, state);
    add_pull(model, *inputs.pull, state, bodies, report);
}

void integrate_tissue(const SceneModel& model, const EffectSet& live, unsigned dropped, State& state, BodiesScratch& bodies,
                      StepReport& report, StepBudget& budget) {
    if (!live.elasticity || !takes_tissue(dropped))
        for (SolidContact& place : state.solids.contacts) place.touch.force.setZero(); // nothing is pushed in this step
    if (takes_tissue(dropped)) {
        const Phase phase(budget, StepPart::Tissue);
        const AccountScope part(budget, report.account[static_cast<std::size_t>(AccountPart::Solve)]);
        integrate_bodies(model, live, state, bodies, report, budget);
    }
    keep_surfaces(model, state, bodies);
}

void predict_instruments(const SceneModel& model, const EffectSet& live, unsigned dropped, State& state, BodiesScratch& bodies, RodsScratch& rods,
                         StepReport& report, StepBudget& budget) {
    const Phase phase(budget, StepPart::LookAhead);
    load_instruments(model, live, state, rods, report);
    rods.tissue_moves = live.elasticity && takes_tissue(dropped);
    if (rods.tissue_moves) move_planes(model, state);
    const bool rough = live.coarse_contact || live.exact_contact; // then the walls' planes of this step are solved against
    for (std::size_t i = 0; i < model.instruments.size(); ++i) if (!is_solved_with_another(model, rods, i)) solve_instrument(model, i, state, rods, rough || leads_together(rods, i));
    find_meetings(model, state, rods);
    push_walls(model, state, bodies, rods);
}

void update_sphere_trees(const SceneModel& model, const EffectSet& live, State& state, SolidScratch& solids, RodsScratch& rods) {
    if (!live.coarse_contact) return;
    update_solid_trees(model, state, live.gravity, solids);
    for (std::size_t i = 0; i < model.instruments.size(); ++i) update_instrument_trees(model, i, state, rods);
    if (!model.budget_covers_step) update_lumens(model, state, rods); // not on its account: always
}

} // namespace trocar::engine
