#include "engine/step/resolve_contacts.hpp"

#include "engine/step/instrument/carry_response.hpp"
#include "engine/step/instrument/instrument_stage.hpp"
#include "engine/step/solid/solid_stage.hpp"
#include "engine/step/solid/touch_rules.hpp"
#include "engine/step/stages.hpp"
#include "engine/prepare/body_pairs.hpp"
#include "engine/time/account.hpp"
#include "engine/time/phase.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace trocar::engine {

namespace {

/// Solves with planes of where the last one has left the rod.
constexpr unsigned kMostPlaneRounds = 3;

/// The planes alone did not keep the rod inside: the exact stage runs whatever it costs.
void force_exact_stage(const SceneModel& model, std::size_t instrument, State& state, RodsScratch& rods, StepReport& report) {
    rods.hits.clear();
    const ExactOutcome outcome = find_exact_contacts(model, instrument, state, rods, report, nullptr);
    report.safe_fraction = std::min(report.safe_fraction, outcome.safe_fraction);
    report.unresolved += outcome.unresolved;
    report.exact_forced = true;
    for (const std::size_t one : solved_with(model, rods, instrument)) rods.instruments[one].is_exact = true;
    if (rods.cull) rods.cull->tell(report);
}

/// Without an exact stage the rod is pushed no further into what it met; nothing proves that this was enough.
void retry_with_drive_stopped(const SceneModel& model, std::size_t instrument, State& state, RodsScratch& rods, StepReport& report) {
    stop_drive(model, instrument, state, rods);
    ++report.drive_stops;
    solve_instrument(model, instrument, state, rods);
}

/// What the rough look ahead does not solve for: a rod against itself, and against others.
bool may_be_carried(const SceneModel& model, std::size_t instrument, const RodsScratch& rods) {
    if (leads_together(rods, instrument)) return false;
    for (const std::size_t one : solved_with(model, rods, instrument))
        if (rods.instruments[one].meets_itself) return false;
    return true;
}

/// What no exact stage has answered is as the traversal proved it; it has where it was forced for every instrument.
void report_proofs(const RodsScratch& rods, StepReport& report) {
    report.exact_ran = report.exact_forced;
    for (const InstrumentScratch& instrument : rods.instruments) {
        if (instrument.is_exact) continue;
        report.exact_ran = false;
        for (const spheretree::LinkStatus status : instrument.proven) report.unproven_links += status != spheretree::LinkStatus::Free;
    }
}

/// Instruments against their walls, where no exact answer stands: planes from the wall, and what is left to do where they do not suffice.
void resolve_walls(const SceneModel& model, const EffectSet& live, State& state, RodsScratch& rods, StepReport& report, StepBudget& budget) {
    if (report.exact_ran) return;
    const bool is_tested = live.coarse_contact || live.exact_contact;
    for (std::size_t i = 0; i < model.instruments.size(); ++i) {
        if (!is_tested) state.instruments[i].kept_inside = false;
        if (is_solved_with_another(model, rods, i)) continue;
        if (!is_tested) {
            if (leads_together(rods, i)) solve_instrument(model, i, state, rods); // bores are there without any effect
            continue;
        }
        follow_walls(model, i, state, rods, &budget);
        if (may_be_carried(model, i, rods) && !budget.response_fits() && carry_response(model, i, state, rods, report, budget)) continue;
        solve_between_walls(model, i, state, rods, budget);
        bool penetrates = penetrates_wall(model, i, state, rods);
        for (unsigned round = 0; penetrates && round < kMostPlaneRounds; ++round) {
            solve_where_it_stands(model, i, state, rods, budget);
            penetrates = penetrates_wall(model, i, state, rods);
        }
        for (const std::size_t one : solved_with(model, rods, i)) state.instruments[one].kept_inside = !penetrates;
        if (!penetrates) continue;
        if (live.exact_contact)
            force_exact_stage(model, i, state, rods, report);
        else
            retry_with_drive_stopped(model, i, state, rods, report);
    }
    report_proofs(rods, report);
}

/// Forces of a solve whose motion was not taken mean nothing; what the tissue felt it did.
void forget_forces(State& state) {
    for (InstrumentState& instrument : state.instruments)
        for (auto* planes : {&instrument.planes, &instrument.self_planes})
            for (fem::RodPlane& plane : *planes) plane.force = 0.0, plane.drag.setZero();
    for (fem::RodMeeting& meeting : state.meetings) {
        const bool stays = meeting.play > 0.0; // a rod rests in its bore on
        meeting.plane.force = stays ? meeting.plane.start_force : 0.0;
        meeting.plane.drag = stays ? meeting.plane.start_drag : Vec3(Vec3::Zero());
    }
}

/// Did an exact stage answer for all instruments, or for one that planes alone did not keep inside?
bool is_exact(const StepReport& report) noexcept { return report.exact_ran || report.exact_forced; }

void check_rods(const SceneModel& model, const RodsScratch& rods, StepReport& report) {
    for (std::size_t i = 0; i < model.instruments.size(); ++i) {
        const Index bad = rods.instruments[i].rod_report.first_bad_node;
        if (bad == kNoIndex || !report.finite) continue;
        report.finite = false;
        report.failure = fmt::format("{}: node {} is not finite", model.instruments[i].name, bad);
    }
}

} // namespace

void resolve_instruments(const SceneModel& model, const EffectSet& live, State& state, BodiesScratch& bodies, RodsScratch& rods,
                         StepReport& report, StepBudget& budget) {
    const AccountScope part(budget, report.account[static_cast<std::size_t>(AccountPart::Walls)]);
    Phase phase(budget, StepPart::Respond);
    const bool coarse_answer = !report.exact_ran;
    resolve_walls(model, live, state, rods, report, budget);
    if (hold_rods(model, state, rods, report)) {
        if (is_exact(report) && report.safe_fraction == 1.0) report.safe_fraction = find_free_share(model, model.contact.exact_distance, state, rods);
        forget_forces(state);
    }
    if (is_exact(report) && report.safe_fraction < 1.0) {
        scale_to_safe_fraction(model, live, report.safe_fraction, state, bodies, rods, report);
        forget_forces(state);
    }
    for (std::size_t i = 0; i < model.instruments.size(); ++i) report_presses(i, state, report);
    report_rods(model, state, rods, report);
    check_rods(model, rods, report);
    if (!coarse_answer || report.exact_forced || report.carried_instruments > 0) phase.forget();
    budget.end_response();
}

void list_contacts(const SceneModel& model, const State& state, const RodsScratch& rods, std::span<const Contact> coarse, StepReport& report,
                   std::vector<Contact>& contacts) {
    contacts.clear();
    for (std::size_t i = 0; i < model.instruments.size(); ++i) {
        const bool is_exact = report.exact_ran || rods.instruments[i].is_exact;
        list_presses(model, i, state, is_exact ? ContactOrigin::ExactVF : ContactOrigin::TestedSpheres, contacts);
    }
    report.pressing_contacts = contacts.size();
    for (std::size_t i = 0; i < model.instruments.size(); ++i) list_self_presses(model, i, state, ContactOrigin::ExactEE, contacts);
    list_meetings(model, state, ContactOrigin::ExactEE, contacts);
    for (const SolidContact& place : state.solids.contacts)
        if (is_touching(place.touch)) contacts.push_back(place.touch);
    for (const Contact& contact : coarse) // solids without a surface's depth; those of instruments are among the presses
        if (is_between_bodies(contact) &&
            !(is_leaf_pair(model, contact) && meet_by_surface(model, contact.a.index(), contact.b.index())))
            contacts.push_back(contact);
}

} // namespace trocar::engine
