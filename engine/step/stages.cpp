#include "engine/step/stages.hpp"

#include "engine/step/instrument/instrument_stage.hpp"
#include "engine/step/solid/solid_trees.hpp"
#include "engine/step/tissue/pull_stage.hpp"
#include "engine/step/tissue/tissue_stage.hpp"
#include "engine/prepare/body_pairs.hpp"
#include "engine/time/phase.hpp"

namespace trocar::engine {

namespace {

/// Surfaces and nodes of the step's start, for the stages that compare with them.
void share_start(const SceneModel& model, StepScratch& scratch) {
    for (std::size_t i = 0; i < model.bodies.size(); ++i) {
        const BodyStart& start = scratch.bodies.start[i];
        scratch.rods.walls[i].surface_t0 = scratch.solids.bodies[i].surface_t0 = start.surface;
        scratch.solids.bodies[i].nodes_t0 = scratch.bodies.start[owner_of(model, i)].tissue.position;
    }
}

bool is_dropped(const StepScratch& scratch, Droppable effect) noexcept { return (scratch.dropped & drop_bit(effect)) != 0; }

} // namespace

EffectSet find_live_effects(const SceneModel& model, const LiveEffects& live) {
    EffectSet effects = model.effects;
    for (const EffectDescriptor* effect : registered_effects())
        if (const double share = live.share(*effect); share < 1.0 && effect->scale != nullptr) effect->scale(effects, share);
    return effects;
}

StepReport& start_report(const SceneModel& model, const State& state, StepReport& report) {
    report = StepReport{};
    report.step = state.step + 1;
    report.time_s = static_cast<double>(report.step) * model.step_s;
    return report;
}

void choose_effects(const SceneModel& model, const Inputs& inputs, StepScratch& scratch, StepBudget& budget) {
    budget.begin(model.budget_covers_step);
    scratch.live = find_live_effects(model, inputs.live);
    scratch.dropped = model.budget_covers_step ? budget.choose_drops(model.drop) : 0u;
    scratch.report.dropped = scratch.dropped;
}

void keep_start(const SceneModel& model, const State& state, StepScratch& scratch) {
    keep_bodies(model, state, scratch.bodies);
    keep_turns(model, state, scratch.solids);
    keep_instruments(model, state, scratch.rods);
}

void restore_start(const SceneModel& model, State& state, const StepScratch& scratch) {
    restore_bodies(model, state, scratch.bodies);
    restore_instruments(model, state, scratch.rods);
}

void apply_inputs(const SceneModel& model, const Inputs& inputs, State& state, StepScratch& scratch) {
    apply_drive_commands(model, inputs.drive, state, scratch.rods, scratch.report);
    if (!inputs.pull || !scratch.live.elasticity) return;
    place_surface(model, inputs.pull->body, state);
    add_pull(model, *inputs.pull, state, scratch.report);
}

void integrate_tissue(const SceneModel& model, State& state, StepScratch& scratch, StepBudget& budget) {
    if (!is_dropped(scratch, Droppable::Elasticity)) {
        const Phase phase(budget, StepPart::Tissue);
        integrate_bodies(model, scratch.live, state, scratch.bodies, scratch.report);
    }
    keep_surfaces(model, state, scratch.bodies);
    share_start(model, scratch);
}

void predict_instruments(const SceneModel& model, const EffectSet& live, State& state, RodsScratch& rods, StepReport& report) {
    load_instruments(model, live, state, rods, report);
    for (std::size_t i = 0; i < model.instruments.size(); ++i) solve_instrument(model, i, state, rods);
}

void update_sphere_trees(const SceneModel& model, State& state, StepScratch& scratch) {
    if (!scratch.live.coarse_contact) return;
    update_solid_trees(model, state, scratch.live.gravity, scratch.solids);
    for (std::size_t i = 0; i < model.instruments.size(); ++i) update_instrument_trees(model, i, state, scratch.rods);
    if (!model.budget_covers_step) update_lumens(model, state, scratch.rods); // not on its account: always
}

} // namespace trocar::engine
