// The step, in the order of the papers: hands, tissue, steering, coarse descent, exact contacts, response.
#include "engine/step/simulator.hpp"

#include "engine/prepare/body_pairs.hpp"
#include "engine/step/blood_stage.hpp"
#include "engine/state/state_bytes.hpp"
#include "engine/step/entry_checks.hpp"
#include "engine/step/instrument_stage.hpp"
#include "engine/step/make_context.hpp"
#include "engine/step/pull_stage.hpp"
#include "engine/step/solid_stage.hpp"
#include "engine/step/solid_touch.hpp"
#include "engine/step/solid_trees.hpp"
#include "engine/step/spring_memory.hpp"
#include "engine/step/tissue_stage.hpp"
#include "engine/step/touch_rules.hpp"
#include "engine/time/phase.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace trocar::engine {

/// Steps that leave a lumen out, for each that forgets some of what it cost: a mesh costs what it costs, and a look that does not pay takes
/// a fifth of a haptic step.
static constexpr std::uint64_t kForgetLumen = 16;

/// Where the first instrument stands; also before the first step.
static void report_first_instrument(const SceneModel& model, const State& state, StepReport& report) {
    if (model.instruments.empty()) return;
    const InstrumentState& first = state.instruments.front();
    report.tip = first.rod.position.back();
    report.insertion_m = first.rod.insertion;
    report.rotation_rad = first.rod.rotation;
    if (!model.instruments.front().route) return;
    const std::vector<Vec3>& moved = first.route.points; // empty before the first step
    const Vec3& target = moved.empty() ? model.instruments.front().route->points.back() : moved.back();
    report.target_distance_m = std::sqrt((target - report.tip).squaredNorm());
}

Simulator::Simulator(const SceneModel& model) : Simulator(model, own_clock_) {}

Simulator::Simulator(const SceneModel& model, const Clock& clock) : Simulator(model, clock, model.budget) {}

Simulator::Simulator(const SceneModel& model, const BudgetLimits& limits) : Simulator(model, own_clock_, limits) {}

Simulator::Simulator(const SceneModel& model, const Clock& clock, const BudgetLimits& limits)
    : model_(model), budget_(clock, limits), state_(make_initial_state(model)), context_(make_step_context(model, state_)) {
    report_first_instrument(model_, state_, context_.report);
    refuse(check_limits(limits));
    refuse(check_settings(model));
}

/// No step will be taken, and the report says why.
void Simulator::refuse(const Result<void>& settings) {
    if (settings.ok() || stopped_) return;
    stopped_ = true;
    context_.report.finite = false;
    context_.report.failure = settings.error().to_string();
}

const StepReport& Simulator::step() {
    begin_step();
    return finish_step();
}

bool Simulator::begin_step() {
    if (stopped_) return false;
    StepReport& report = context_.report;
    if (begun_) return report.finite;
    begun_ = true;
    report = StepReport{};
    report.step = state_.step + 1;
    report.time_s = static_cast<double>(report.step) * model_.step_s;
    budget_.begin();
    if (!model_.budget_covers_step) budget_.pause();
    dropped_ = model_.budget_covers_step ? budget_.choose_drops(model_.drop) : 0u;
    report.dropped = dropped_;
    const StopWatch total;
    move_everything();
    report.ms.total = total.elapsed_ms();
    return report.finite;
}

void Simulator::move_everything() {
    StepReport& report = context_.report;
    StopWatch lap;
    keep_start(model_, state_, context_);
    apply_drive_commands(model_, state_, context_);
    if (state_.pull) place_surface(model_, state_.pull->body, state_);
    add_pull(model_, state_, report);
    report.ms.script = lap.lap_ms();
    if (!is_dropped(Droppable::Elasticity)) {
        const Phase phase(budget_, StepPart::Tissue);
        integrate_bodies(model_, state_, context_);
    }
    report.ms.fem = lap.lap_ms();
    keep_surfaces(model_, state_, context_);
    if (!report.finite) return;
    Phase phase(budget_, StepPart::EmbeddedSurfaces);
    update_embedded_surfaces(model_, state_, context_);
    report.ms.steer = lap.lap_ms();
    find_blood_flow(model_, state_, context_);
    for (std::size_t i = 0; i < model_.instruments.size(); ++i) solve_instrument(model_, i, state_, context_);
    report.ms.fem += lap.lap_ms();
    if (model_.effects.coarse_contact) {
        update_solid_trees(model_, state_, context_);
        for (std::size_t i = 0; i < model_.instruments.size(); ++i) update_instrument_trees(model_, i, state_, context_);
        if (!model_.budget_covers_step) update_lumens(model_, state_, context_); // not on its account: always
    }
    phase.end();
    report.ms.steer += lap.lap_ms();
}

const StepReport& Simulator::finish_step() {
    StepReport& report = context_.report;
    if (stopped_ || !begun_) return report;
    begun_ = false;
    StopWatch total, lap;
    if (report.finite) {
        if (!model_.budget_covers_step) budget_.resume();
        descend();
        report.ms.descend = lap.lap_ms();
        find_exact();
        report.ms.exact = lap.lap_ms();
        if (!model_.budget_covers_step) budget_.pause();
        Phase phase(budget_, StepPart::Respond);
        const bool coarse_answer = !report.exact_ran;
        respond();
        if (!coarse_answer || report.exact_forced) phase.forget();
        phase.end();
        report.ms.respond = lap.lap_ms();
        check_rods();
    }
    report.ms.total += total.elapsed_ms();
    budget_.pause();
    report.ms.budget = 1e3 * budget_.elapsed_s();
    report.ms.budget_cpu = 1e3 * budget_.elapsed_cpu_s();
    report.budget_kept = !budget_.overrun();
    report.work_units = budget_.units_spent();
    if (report.finite) {
        ++state_.step;
        state_.time = report.time_s;
        const StopWatch watch;
        observe();
        report.ms.observe = watch.elapsed_ms();
    }
    finish_report();
    return report;
}

Result<void> Simulator::restore(const State& state) {
    const auto wrong = [](std::string message) { return Error{.code = ErrorCode::BadValue, .message = std::move(message), .key = "restore"}; };
    if (std::string misfit = find_misfit(model_, state); !misfit.empty()) return wrong(std::move(misfit));
    begun_ = false;
    state_ = state;
    reserve_state(model_, state_);
    forget_scratch(context_);
    context_.report = StepReport{};
    context_.report.step = state_.step;
    context_.report.time_s = state_.time;
    context_.contacts.clear();
    report_first_instrument(model_, state_, context_.report);
    stopped_ = false;
    refuse(check_limits(budget_.limits()));
    refuse(check_settings(model_));
    return {};
}

Result<void> Simulator::set_drive_command(std::size_t instrument, const DriveCommand& wanted) {
    Result<void> fine = check_drive_command(model_, instrument, wanted);
    if (fine.ok()) state_.instruments[instrument].hand = wanted;
    return fine;
}

Result<void> Simulator::set_pull(const std::optional<Pull>& pull) {
    Result<void> fine = pull ? check_pull(model_, *pull) : Result<void>();
    if (fine.ok()) state_.pull = pull;
    return fine;
}

Result<void> Simulator::set_budget(const BudgetLimits& limits) {
    Result<void> fine = check_limits(limits);
    if (fine.ok()) budget_.set_limits(limits);
    return fine;
}

std::optional<DriveCommand> Simulator::follow_route(std::size_t instrument) {
    if (instrument >= model_.instruments.size() || !model_.instruments[instrument].route) return std::nullopt;
    return steer_along_route(model_, instrument, state_, context_);
}

void Simulator::effects_changed() {
    for (BodyState& body : state_.bodies) body.lumen.reset();
    for (InstrumentState& instrument : state_.instruments) instrument.kept_inside = false;
}

/// The balls that instruments are looked for in, where the budget covers them and has time for them and for what follows. False: it has
/// not.
bool Simulator::follow_lumens(double after_s) {
    if (!any_instrument() || !model_.budget_covers_step) return true;
    budget_.keep_back(after_s + budget_.forecast(StepPart::Lumen).reserve_s());
    const bool fits = budget_.grant_descent().left() > 0;
    budget_.keep_back(after_s);
    if (!fits && !context_.descent.has_solids()) { // those would have to wait with it
        if (state_.step % kForgetLumen == 0) budget_.leave_out(StepPart::Lumen);
        return false;
    }
    bool sizes_lumens = false; // the first time: it says nothing of the next
    for (const InstrumentModel& instrument : model_.instruments) sizes_lumens |= !state_.bodies[instrument.lumen].lumen.has_bounds();
    Phase phase(budget_, StepPart::Lumen);
    update_lumens(model_, state_, context_);
    if (sizes_lumens) phase.forget();
    return true;
}

void Simulator::descend() {
    context_.coarse.clear();
    const double after = model_.budget_covers_step ? budget_.forecast(StepPart::Respond).reserve_s() : 0.0;
    budget_.keep_back(after);
    if (!model_.effects.coarse_contact) return;
    context_.report.effects.note(Effect::CoarseContact);
    const double listing = after + budget_.forecast(StepPart::List).reserve_s();
    budget_.keep_back(listing);
    context_.descent.begin(model_.contact.margin);
    add_solid_pairs(model_, context_);
    for (std::size_t i = 0; i < model_.instruments.size(); ++i) add_to_descent(model_, i, state_, context_.descent);
    for (bool finished = !follow_lumens(listing); !finished;) {
        WorkBudget grant = budget_.grant_descent(context_.descent.next_cost());
        if (grant.left() == 0) break;
        finished = context_.descent.run(grant);
        budget_.settle_descent(grant);
    }
    {
        const Phase phase(budget_, StepPart::List);
        context_.descent.add_contacts(context_.coarse);
    }
    budget_.keep_back(after);
    const spheretree::DescentStats& stats = context_.descent.stats();
    StepReport& report = context_.report;
    report.pairs_tested = stats.pairs_tested;
    report.pairs_open = stats.pairs_open;
    report.leaf_contacts = stats.leaf_contacts;
    report.level_reached = stats.level_reached;
    for (const Contact& contact : context_.coarse) report.assumed += contact.origin == ContactOrigin::AssumedSpheres;
}

void Simulator::find_exact() {
    context_.exact.clear();
    if (!model_.effects.exact_contact) return;
    StepReport& report = context_.report;
    report.exact_ran = any_instrument();
    for (std::size_t i = 0; i < model_.instruments.size(); ++i) {
        if (is_coaxial_inner(model_, i)) continue;
        InstrumentScratch& scratch = context_.instruments[i];
        const std::size_t wall = model_.instruments[i].lumen;
        scratch.forecast.triangles = scratch.forecast.wall_triangles = 0;
        for (const std::size_t one : coaxial(model_, i)) scratch.forecast.triangles += model_.instruments[one].topology.triangles.size();
        if (model_.bodies[wall].moves()) scratch.forecast.wall_triangles = model_.bodies[wall].surface.triangles.size();
        scratch.forecast.candidates = state_.instruments[i].exact_candidates;
        if (!is_dropped(Droppable::ExactContact) && budget_.exact_fits(scratch.forecast)) {
            refit(wall);
            budget_.charge_refit(scratch.forecast.wall_triangles);
            const ExactOutcome outcome = find_exact_contacts(model_, i, state_, context_, &budget_);
            budget_.end_exact(outcome.finished);
            if (outcome.finished) {
                report.safe_fraction = std::min(report.safe_fraction, outcome.safe_fraction);
                continue;
            }
            report.exact_abandoned = true;
        }
        report.exact_ran = false;
        context_.exact.clear();
    }
    report.exact_contacts = context_.exact.size();
    if (context_.cull) context_.cull->tell(report);
}

/// A wall's boxes, with their cost remembered.
void Simulator::refit(std::size_t wall) {
    const Phase phase(budget_, StepPart::Refit);
    refit_wall(model_, wall, state_, context_);
}

void Simulator::set_cull_device(std::unique_ptr<collision::CullBackend> device) {
    if (context_.cull && device) context_.cull->set_device(std::move(device));
}

std::span<const std::string> Simulator::cull_notes() const noexcept {
    return context_.cull ? std::span<const std::string>(context_.cull->notes()) : std::span<const std::string>();
}

void Simulator::respond() {
    StepReport& report = context_.report;
    for (std::size_t i = 0; i < model_.instruments.size(); ++i) {
        const bool looked_at = model_.effects.coarse_contact || model_.effects.exact_contact;
        if (!looked_at) state_.instruments[i].kept_inside = false;
        if (report.exact_ran || is_coaxial_inner(model_, i) || !looked_at) continue;
        if (model_.effects.exact_contact)
            refit(model_.instruments[i].lumen);
        else
            follow_wall(model_, model_.instruments[i].lumen, state_, context_);
        solve_between_walls(model_, i, state_, context_, budget_);
        const bool penetrates = penetrates_wall(model_, i, state_, context_);
        for (const std::size_t one : coaxial(model_, i)) state_.instruments[one].kept_inside = !penetrates;
        if (!penetrates) continue;
        if (model_.effects.exact_contact)
            force_exact_stage(i);
        else
            retry_with_drive_stopped(i);
    }
    report.exact_contacts = context_.exact.size();
    if (!report.exact_ran && model_.effects.coarse_contact)
        for (std::size_t i = 0; i < model_.instruments.size(); ++i)
            for (const spheretree::LinkStatus status : context_.descent.link_status(i))
                report.unproven_links += status != spheretree::LinkStatus::Free;
    if (report.exact_ran && report.safe_fraction < 1.0) {
        scale_to_safe_fraction(report.safe_fraction);
        forget_forces();
    }
    report.residual_n = find_residual(model_, state_, context_);
    note_held(model_, state_, context_.solids);
    for (BodyState& body : state_.bodies) body.springs.clear();
    for (std::size_t i = 0; i < model_.instruments.size(); ++i) push_wall(model_, i, state_, report);
    push_solids(model_, state_, context_);
    list_contacts();
}

void Simulator::list_contacts() {
    context_.contacts.clear();
    for (std::size_t i = 0; i < model_.instruments.size(); ++i) list_presses(model_, i, state_, context_);
    if (context_.report.exact_ran) context_.report.exact_contacts += context_.contacts.size();
    for (const Contact& touch : context_.solids.touches)
        if (touch.gap <= 0.0) context_.contacts.push_back(touch);
    for (const Contact& contact : context_.coarse) // solids without a surface's depth; those of instruments are among the presses
        if (contact.body_a < model_.bodies.size() && contact.body_b < model_.bodies.size() &&
            !(is_leaf_pair(model_, contact) && meet_by_surface(model_, contact.body_a, contact.body_b)))
            context_.contacts.push_back(contact);
}

/// A rod that is not finite stops the run before its state is taken over.
void Simulator::check_rods() {
    StepReport& report = context_.report;
    for (std::size_t i = 0; i < model_.instruments.size(); ++i) {
        const Index bad = context_.instruments[i].rod_report.first_bad_node;
        if (bad == kNoIndex || !report.finite) continue;
        report.finite = false;
        report.failure = fmt::format("{}: node {} is not finite", model_.instruments[i].name, bad);
    }
}

/// The planes alone did not keep the rod inside: the exact stage runs whatever it costs, and the budget is charged for it.
void Simulator::force_exact_stage(std::size_t instrument) {
    if (!model_.budget_covers_step) budget_.resume();
    context_.exact.clear();
    const ExactOutcome outcome = find_exact_contacts(model_, instrument, state_, context_, nullptr);
    context_.report.safe_fraction = std::min(context_.report.safe_fraction, outcome.safe_fraction);
    context_.report.exact_ran = true;
    context_.report.exact_forced = true;
    if (context_.cull) context_.cull->tell(context_.report);
    if (!model_.budget_covers_step) budget_.pause();
}

/// Without an exact stage the rod is pushed no further into what it met; nothing proves that this was enough.
void Simulator::retry_with_drive_stopped(std::size_t instrument) {
    stop_drive(model_, instrument, state_, context_);
    ++context_.report.drive_stops;
    solve_instrument(model_, instrument, state_, context_);
}

void Simulator::observe() {
    StepReport& report = context_.report;
    for (std::size_t i = 0; i < model_.bodies.size(); ++i)
        if (model_.bodies[i].hollow && model_.bodies[i].moves()) context_.bodies[i].inside.follow(state_.bodies[i].surface);
    for (std::size_t i = 0; i < model_.instruments.size(); ++i) {
        report.lumen_exits += count_lumen_exits(model_, i, state_, context_);
        const fem::RodReport& rod = context_.instruments[i].rod_report;
        report.kinetic_j += rod.kinetic_j;
        report.elastic_j += rod.bend_j + rod.stretch_j + rod.twist_j;
    }
}

void Simulator::finish_report() {
    StepReport& report = context_.report;
    report_first_instrument(model_, state_, context_.report);
    if (report.finite) return;
    stopped_ = true;
    restore_start(model_, state_, context_); // the last good state
}

const State& Simulator::state() noexcept {
    for (std::size_t i = 0; i < model_.bodies.size(); ++i) place_surface(model_, i, state_);
    return state_;
}

std::span<const Contact> Simulator::contacts() const noexcept { return context_.contacts; }

} // namespace trocar::engine
