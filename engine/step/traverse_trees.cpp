#include "engine/step/traverse_trees.hpp"

#include "engine/step/instrument/instrument_stage.hpp"
#include "engine/step/solid/solid_stage.hpp"
#include "engine/step/solid/choose_surfaces.hpp"
#include "engine/step/stages.hpp"
#include "engine/effects/registry.hpp"
#include "engine/time/account.hpp"
#include "engine/time/phase.hpp"

#include <algorithm>

namespace trocar::engine {

namespace {

/// Steps that leave a lumen out, for each that forgets some of what it cost: a mesh costs what it costs, and an attempt that does not pay
/// takes a fifth of a haptic step.
constexpr std::uint64_t kForgetLumen = 16;
/// Of the budget: kept for the response between walls. One that takes longer is carried from step to step (carry_response.hpp), and what that
/// takes is kept.
constexpr double kMostKept = 0.5;

/// The inscribed spheres that instruments are looked for in, where the budget covers them and has time for them and for what follows.
/// False: it has not.
bool follow_lumens(const SceneModel& model, double after_s, const spheretree::Descent& descent, State& state, RodsScratch& rods,
                   std::uint64_t after_units, StepBudget& budget) {
    if (model.instruments.empty() || !model.budget_covers_step) return true;
    budget.keep_back(after_s + budget.forecast(StepPart::Lumen).reserve_s(), after_units);
    const bool fits = budget.grant_descent().left() > 0;
    budget.keep_back(after_s, after_units);
    if (!fits && !descent.has_solids()) { // those would have to wait with it
        if (state.step % kForgetLumen == 0) budget.leave_out(StepPart::Lumen);
        return false;
    }
    bool sizes_lumens = false; // the first time: it says nothing of the next
    for (const InstrumentModel& instrument : model.instruments) sizes_lumens |= !state.bodies[instrument.lumen].lumen.has_bounds();
    Phase phase(budget, StepPart::Lumen);
    update_lumens(model, state, rods);
    if (sizes_lumens) phase.forget();
    return true;
}

void report_traversal(const TraversalScratch& traversal, StepReport& report) {
    const spheretree::DescentStats& stats = traversal.descent.stats();
    report.pairs_tested = stats.pairs_tested;
    report.pairs_open = stats.pairs_open;
    report.leaf_contacts = stats.leaf_contacts;
    report.level_reached = stats.level_reached;
    for (const Contact& contact : traversal.coarse) report.assumed += contact.origin == ContactOrigin::AssumedSpheres;
}

} // namespace

void traverse_sphere_trees(const SceneModel& model, const EffectSet& live, State& state, SolidScratch& solids, RodsScratch& rods,
                           TraversalScratch& traversal, StepReport& report, StepBudget& budget) {
    const Timed timed(report.ms.descend, report.ms.total, budget, ProbedPart::Descent);
    spheretree::Descent& descent = traversal.descent;
    std::vector<Contact>& coarse = traversal.coarse;
    coarse.clear();
    solids.coarse = {};
    const AccountScope part(budget, report.account[static_cast<std::size_t>(AccountPart::Descent)]);
    const double carrying = std::max(kMostKept * budget.limit_s(), budget.forecast(StepPart::Renew).reserve_s());
    double after = std::min(budget.forecast(StepPart::Respond).reserve_s(), carrying);
    budget.keep_back(after);
    const SurfaceNeed need = forecast_surfaces(model, state, solids);
    const std::uint64_t surfaces = budget.surfaces_share_units(need);
    const double surfaces_s = budget.surfaces_share_s(need);
    after += surfaces_s;
    budget.keep_back(surfaces_s, surfaces);
    if (!live.coarse_contact) return;
    report.effects.note(effects::coarse_contact);
    const double listing = after + budget.least_listing_s();
    budget.keep_back(listing, surfaces);
    descent.begin(model.contact.margin);
    add_solid_pairs(model, solids, descent, report);
    for (std::size_t i = 0; i < model.instruments.size(); ++i) add_to_descent(model, i, state, descent);
    for (bool finished = !follow_lumens(model, listing, descent, state, rods, surfaces, budget); !finished;) {
        const spheretree::DescentStats& so_far = descent.stats();
        budget.keep_back(std::max(listing, after + budget.listing_s(so_far.pairs_open + so_far.leaf_contacts)), surfaces);
        WorkBudget grant = budget.grant_descent(descent.next_cost());
        if (grant.left() == 0) break;
        finished = descent.run(grant);
        budget.settle_descent(grant);
    }
    {
        const Phase phase(budget, StepPart::List);
        descent.add_contacts(coarse);
    }
    budget.learn_listing(coarse.size());
    solids.coarse = coarse;
    for (std::size_t i = 0; i < model.instruments.size(); ++i) rods.instruments[i].proven = descent.link_status(i);
    budget.keep_back(surfaces_s, surfaces); // an exact answer of the instruments takes the place of the response
    report_traversal(traversal, report);
}

void detect_exact_contacts(const SceneModel& model, const EffectSet& live, unsigned dropped, State& state, RodsScratch& rods,
                           StepReport& report, StepBudget& budget) {
    const Timed timed(report.ms.exact, report.ms.total, budget, ProbedPart::Exact);
    const AccountScope part(budget, report.account[static_cast<std::size_t>(AccountPart::Exact)]);
    rods.hits.clear();
    if (!live.exact_contact) return;
    const bool is_dropped = (dropped & drop_bit(Droppable::ExactContact)) != 0;
    report.exact_ran = !model.instruments.empty();
    const unsigned corrections = report.corrections, drive_stops = report.drive_stops;
    for (std::size_t i = 0; i < model.instruments.size(); ++i) {
        InstrumentScratch& own = rods.instruments[i];
        own.before_exact = {own.command, state.instruments[i].drive_stopped, own.slowed};
    }
    for (std::size_t i = 0; i < model.instruments.size(); ++i) {
        if (is_solved_with_another(model, rods, i)) continue;
        const ExactForecast forecast = forecast_exact(model, i, state, rods);
        rods.instruments[i].forecast = forecast;
        if (!is_dropped && budget.exact_fits(forecast)) {
            follow_walls(model, i, state, rods, &budget);
            const ExactOutcome outcome = find_exact_contacts(model, i, state, rods, report, &budget);
            budget.end_exact(outcome.finished);
            if (outcome.finished) {
                report.safe_fraction = std::min(report.safe_fraction, outcome.safe_fraction);
                report.unresolved += outcome.unresolved;
                continue;
            }
            report.exact_abandoned = true;
        }
        report.exact_ran = false;
        rods.hits.clear();
    }
    if (!report.exact_ran) { // what was found is of motions that are solved anew, of drives that were not stopped
        report.exact_contacts = report.unresolved = 0;
        report.corrections = corrections, report.drive_stops = drive_stops;
        report.safe_fraction = 1.0;
        rods.hits.clear();
        for (std::size_t i = 0; i < model.instruments.size(); ++i) {
            InstrumentScratch& own = rods.instruments[i];
            own.command = own.before_exact.command;
            own.slowed = own.before_exact.slowed;
            state.instruments[i].drive_stopped = own.before_exact.drive_stopped;
        }
    }
    if (rods.cull) rods.cull->tell(report);
}

} // namespace trocar::engine
