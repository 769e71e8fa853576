#include "engine/step/step.hpp"

#include "engine/step/finish_report.hpp"
#include "engine/step/resolve_contacts.hpp"
#include "engine/step/solid/solid_stage.hpp"
#include "engine/step/stages.hpp"
#include "engine/step/tissue/tissue_stage.hpp"
#include "engine/step/traverse_trees.hpp"
#include "engine/time/account.hpp"
#include "engine/time/phase.hpp"

namespace trocar::engine {

bool begin_step(const SceneModel& model, const Inputs& inputs, State& state, StepScratch& scratch, StepBudget& budget) {
    StepReport& report = start_report(model, state, scratch.report);
    scratch.dropped = choose_drops(model, budget, report);
    find_live_effects(model, inputs.live, scratch.live);
    const EffectSet& live = scratch.live;
    {
        const Timed timed(report.ms.script, report.ms.total, budget, ProbedPart::Script);
        keep_start(model, state, scratch.bodies, scratch.solids, scratch.rods);
        apply_inputs(model, live, scratch.dropped, inputs, state, scratch.bodies, scratch.rods, report);
    }
    {
        const Timed timed(report.ms.fem, report.ms.total, budget, ProbedPart::Prediction);
        predict_instruments(model, live, scratch.dropped, state, scratch.bodies, scratch.rods, report, budget);
    }
    {
        const Timed timed(report.ms.fem, report.ms.total, budget, ProbedPart::Tissue);
        integrate_tissue(model, live, scratch.dropped, state, scratch.bodies, report, budget);
        share_start(model, scratch.bodies, scratch.solids, scratch.rods);
    }
    if (!report.finite) return false;
    const Phase phase(budget, StepPart::EmbeddedSurfaces);
    {
        const Timed timed(report.ms.steer, report.ms.total, budget, ProbedPart::Surfaces);
        update_embedded_surfaces(model, live, state, scratch.bodies, report);
    }
    const Timed timed(report.ms.steer, report.ms.total, budget, ProbedPart::Trees);
    update_sphere_trees(model, live, state, scratch.solids, scratch.rods);
    return true;
}

const StepReport& finish_step(const SceneModel& model, State& state, StepScratch& scratch, StepBudget& budget) {
    StepReport& report = scratch.report;
    const CollisionScope charged(budget);
    if (report.finite) {
        traverse_sphere_trees(model, scratch.live, state, scratch.solids, scratch.rods, scratch.traversal, report, budget);
        detect_exact_contacts(model, scratch.live, scratch.dropped, state, scratch.rods, report, budget);
    }
    if (report.finite) {
        const Timed timed(report.ms.respond, report.ms.total, budget, ProbedPart::Instruments);
        resolve_instruments(model, scratch.live, state, scratch.bodies, scratch.rods, report, budget);
    }
    if (report.finite) {
        const Timed timed(report.ms.respond, report.ms.total, budget, ProbedPart::Solids);
        const AccountScope part(budget, report.account[static_cast<std::size_t>(AccountPart::Surfaces)]);
        push_solids(model, state, scratch.solids, report, budget);
        list_contacts(model, state, scratch.rods, scratch.traversal.coarse, report, scratch.contacts);
    }
    return finish_report(model, state, scratch.bodies, scratch.solids, scratch.rods, report, budget);
}

} // namespace trocar::engine
