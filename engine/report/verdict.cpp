#include "engine/report/verdict.hpp"

#include <fmt/format.h>

#include <cmath>

namespace trocar::engine {

namespace {

constexpr const char* kThinSpace = "\xE2\x80\xAF"; // narrow, no break

std::string grouped(std::uint64_t count) {
    const std::string digits = std::to_string(count);
    std::string text;
    for (std::size_t i = 0; i < digits.size(); ++i) {
        if (i > 0 && digits.size() > 4 && (digits.size() - i) % 3 == 0) text += kThinSpace;
        text += digits[i];
    }
    return text;
}

std::string of_steps(std::uint64_t part, const RunRecord& record) {
    return fmt::format("{} of {}", grouped(part), count_text(record.statistics.steps, "step", "steps"));
}

std::string ms(double value) { return number_text(value) + " ms"; }

std::string all_steps(const RunRecord& record) {
    return record.statistics.steps == 1 ? "the one step" : "all " + count_text(record.statistics.steps, "step", "steps");
}

/// Whole steps against the time they simulate: a budget for a part of the step says nothing of those.
std::string realtime_text(const RunRecord& record) {
    const std::uint64_t slower = record.summary.realtime_overruns;
    const std::string step = ms(1e3 * record.scene.time.step);
    if (slower == 0) return fmt::format("No whole step took longer than the {} it simulates.", step);
    return fmt::format("{} took longer than the {} that each simulates: {:.4g} % of the whole steps were no slower than real time.",
                       of_steps(slower, record), step, percent_of(record.summary.realtime_kept));
}

/// "; 98.66 % of the steps ended within the 10 ms they simulate"
std::string realtime_share(const RunRecord& record) {
    return fmt::format("; {:.4g} % of the steps ended within the {} they simulate", percent_of(record.summary.realtime_kept), ms(1e3 * record.scene.time.step));
}

Verdict wall_verdict(const RunRecord& record) {
    const BudgetSpec& budget = record.scene.budget;
    const RunStatistics& t = record.statistics;
    const std::uint64_t slower = record.summary.realtime_overruns;
    const std::string limit = ms(1e3 * budget.limits.wall_s);
    const char* who = budget.scope == BudgetScope::Step ? "Whole steps" : "Collision detection";
    const std::string too_slow = realtime_share(record);
    if (t.overruns == 0)
        return {slower > 0 ? Mark::Note : Mark::Good,
                fmt::format("{} kept the budget of {} in {}{}.", who, limit, all_steps(record), too_slow),
                fmt::format("The budget is for {}, of which the slowest used {}.", scope_text(budget), ms(t.worst_charged_ms))};
    return {record.summary.budget_kept >= 0.99 ? Mark::Note : Mark::Bad,
            fmt::format("{} missed the budget of {} in {} ({:.2g} %){}.", who, limit, of_steps(t.overruns, record),
                        100.0 * (1.0 - record.summary.budget_kept), too_slow),
            fmt::format("The budget is for {}; missed by {} at worst.", scope_text(budget), ms(t.worst_overrun_ms))};
}

Verdict budget_verdict(const RunRecord& record) {
    const BudgetLimits& limits = record.scene.budget.limits;
    const std::string steps = count_text(record.statistics.steps, "step", "steps");
    if (record.statistics.steps == 0) return {Mark::Note, "No step was taken.", "There is nothing to judge."};
    if (limits.mode == BudgetMode::Wall) return wall_verdict(record);
    if (limits.mode == BudgetMode::Work)
        return {Mark::Good, fmt::format("{} with {} units of work each{}.", steps, grouped(limits.work_units), realtime_share(record)),
                "No clock decides: the same input gives the same bits, on every run."};
    return {Mark::Good, fmt::format("{} without a budget{}.", steps, realtime_share(record)),
            fmt::format("Everything was tested in every step; the slowest took {}.", ms(record.summary.step_ms.max))};
}

/// Zero is the expected value.
Loss make_loss(const char* name, std::uint64_t amount, std::string text, Mark mark, std::string advice) {
    if (amount == 0) return {Mark::Good, name, "none", {}};
    return {mark, name, std::move(text), std::move(advice)};
}

/// A loss that changes what the scene asks for.
Loss loud(Loss loss) {
    loss.loud = true;
    return loss;
}

/// ": 0.01 ms is below the floor of 0.04 ms"; empty where that was not measured, or the budget is above it most of the time.
std::string floor_text(const RunRecord& record) {
    const double budget = 1e3 * record.scene.budget.limits.wall_s, floor = record.summary.floor_ms;
    return floor > budget ? fmt::format(": {} is below the floor of {}", ms(budget), ms(floor)) : std::string();
}

void add_contact_losses(const RunRecord& record, std::vector<Loss>& losses) {
    const RunStatistics& t = record.statistics;
    const EffectSet& effects = record.prepared.model.effects;
    const bool instruments = !record.prepared.model.instruments.empty();
    if (effects.coarse_contact)
        losses.push_back(
            make_loss("Assumed contacts", t.assumed,
                      fmt::format("{} stood for contacts", count_text(t.assumed, "untested sphere pair", "untested sphere pairs")),
                      Mark::Note, "A larger budget lets the descent end."));
    if (effects.coarse_contact)
        losses.push_back(make_loss("Open sphere pairs", t.open_steps,
                                   fmt::format("in {}, as coarse as level {}", of_steps(t.open_steps, record), t.coarsest_level),
                                   Mark::Note, "The descent ended there, with the answer it had."));
    if (t.floor_steps > 0)
        losses.push_back(make_loss("Budget below the floor", t.floor_steps,
                                   fmt::format("in {}{}", of_steps(t.floor_steps, record), floor_text(record)), Mark::Bad,
                                   "The budget was overrun by what a step does whatever the budget: all that may be left out was left out "
                                   "(docs/budget.md)."));
    if (effects.coarse_contact && t.left_pairs > 0)
        losses.push_back(make_loss("Surfaces left by the budget", t.left_steps,
                                   fmt::format("{} pairs of bodies and of their leaves in {}", t.left_pairs, of_steps(t.left_steps, record)),
                                   Mark::Note, "They were held where their spheres meet (held_pairs, carried_places in steps.csv)."));
    if (t.carried_steps > 0)
        losses.push_back(make_loss("Instruments between walls of earlier steps", t.carried_steps, fmt::format("in {}", of_steps(t.carried_steps, record)),
                                   Mark::Note, "There was no time to find the walls' planes at all places and to solve the rods between them: the rods ended at their predicted "
                                   "positions, bounded by planes that are up to two steps old (carried_instruments, carried_places in steps.csv)."));
    if (effects.coarse_contact && t.unconverged_solves > 0)
        losses.push_back(make_loss("Contact solves that ended at their bound", t.unconverged_steps,
                                   fmt::format("{} sub-steps in {}", t.unconverged_solves, of_steps(t.unconverged_steps, record)), Mark::Note,
                                   "Both bodies got the same impulses, so momentum is conserved; the residual is contact_residual_n in "
                                   "steps.csv."));
    if (t.raised_steps > 0)
        losses.push_back(make_loss("More sub-steps than asked for", t.raised_steps,
                                   fmt::format("in {}, {} at the most; time.substeps asks for {}", of_steps(t.raised_steps, record), t.substeps,
                                               record.prepared.model.fixed_substeps),
                                   Mark::Note, "The tissue as it was deformed and pressed then, or the springs of its loads, would not have been stable with fewer; of implicit steps, one that did "
                                               "not converge is taken in parts."));
    if (t.explicit_steps > 0)
        losses.push_back(make_loss("Implicit steps that did not converge", t.explicit_steps,
                                   fmt::format("{} in {}", count_text(t.explicit_bodies, "body", "bodies"), of_steps(t.explicit_steps, record)), Mark::Note,
                                   "Explicit sub-steps took their place, as many as the tissue's stiffness asks for: these steps take the time of both. Shorter "
                                   "steps, or smaller loads, may converge."));
    if (t.slowed_steps > 0)
        losses.push_back(make_loss("Rods slowed", t.slowed_steps, fmt::format("in {}", of_steps(t.slowed_steps, record)), Mark::Note,
                                   "They would have moved by more than 1.2 mm in a step, farther than the wall near them was known. Shorter "
                                   "steps show such snaps."));
    if (t.stretched_steps > 0)
        losses.push_back(loud(make_loss("Rods stretched beyond what they are", t.stretched_steps,
                                        fmt::format("in {}, by up to {:.3g} % of a segment", of_steps(t.stretched_steps, record), 100.0 * t.largest_stretch), Mark::Bad,
                                        "A rod is all but inextensible: one of metal or polymer has broken, or folded, long before. A clamped tip whose rod is drawn back, or a load of far too many "
                                        "newtons, does this (rod_stretch in steps.csv).")));
    if (t.self_held_steps > 0)
        losses.push_back(make_loss("Rods held before themselves", t.self_held_steps, fmt::format("in {}", of_steps(t.self_held_steps, record)),
                                   Mark::Note, "Only a part of their motion was proven not to pass through themselves, and that part was taken "
                                               "(self_held in steps.csv)."));
    if (t.instrument_held_steps > 0)
        losses.push_back(make_loss("Instruments held before one another", t.instrument_held_steps, fmt::format("in {}", of_steps(t.instrument_held_steps, record)),
                                   Mark::Note, "Only a part of their motion was proven not to pass through another one, and that part was taken "
                                               "(instrument_held in steps.csv)."));
    if (t.beyond_bore_steps > 0)
        losses.push_back(make_loss("Instruments beyond their bore", t.beyond_bore_steps,
                                   fmt::format("in {}, by {:.2g} mm at most", of_steps(t.beyond_bore_steps, record), 1e3 * t.largest_bore_excess_m), Mark::Note,
                                   "By more than a tenth of their play (bore_excess_m in steps.csv): a wire far softer than the tube around it has folded, "
                                   "or moved too far in a step. Shorter steps, or \"play\": false."));
    if (t.unsettled_rods > 0)
        losses.push_back(make_loss("Rod solves that ended at their bound", t.unsettled_steps,
                                   fmt::format("{} stages in {}", t.unsettled_rods, of_steps(t.unsettled_steps, record)), Mark::Note,
                                   "Contact forces of these steps had not settled; what is missing of the rods' balance is rod_balance_n in "
                                   "steps.csv."));
    if (effects.coarse_contact && t.deep_steps > 0)
        losses.push_back(
            loud(make_loss("Solids deep in one another", t.deep_steps,
                           fmt::format("by up to {} mm, up to {:.0f} % of the thinner one, in {}", number_text(1e3 * t.deepest_touch_m),
                                       100.0 * t.deepest_share, of_steps(t.deep_steps, record)),
                           Mark::Note, "What lies so deep came unseen, or is pressed harder than the flesh beneath it bears: a shorter step, or a gentler press.")));
    if (effects.coarse_contact && t.passed_steps + t.unproven_solid_steps > 0) { // only where solids press that hard, or go that fast
        losses.push_back(make_loss("Solids deeper than the middle", t.passed_steps, fmt::format("in {}", of_steps(t.passed_steps, record)),
                                   Mark::Note,
                                   "Places beyond the middle of another body, or through it, were pushed back to where they came from. A "
                                   "shorter step may spare them."));
        losses.push_back(loud(make_loss(
            "Solids that may have passed through", t.unproven_solid_steps,
            fmt::format("{} in {}", count_text(t.unproven_solids, "pair", "pairs"), of_steps(t.unproven_solid_steps, record)), Mark::Bad,
            "They went farther than half of the thinner one's thickness in a step and their paths were not tested; or "
            "one began inside the other, and they do not touch. A shorter step, closed surfaces with the response "
            "of surfaces, a larger budget, or bodies that begin apart.")));
    }
    if (!instruments) return;
    if (effects.exact_contact) {
        const std::uint64_t skipped = t.steps - t.exact_steps;
        losses.push_back(make_loss(
            "Exact contacts skipped", skipped,
            fmt::format("in {}{}", of_steps(skipped, record),
                        t.exact_abandoned > 0 ? fmt::format(", {} of them begun and thrown away", grouped(t.exact_abandoned)) : ""),
            Mark::Note, "Sphere trees alone gave the answer there. A larger budget, or fewer skin_triangles."));
        losses.push_back(
            make_loss("Budget set aside for safety", t.exact_forced, fmt::format("in {}", of_steps(t.exact_forced, record)), Mark::Note,
                      "The exact stage did not fit but ran all the same: without it the instrument would have left the lumen."));
        losses.push_back(make_loss("Tests without a verdict", t.unresolved, grouped(t.unresolved), Mark::Note,
                                   "Each was taken as a contact; motion was scaled to the safe fraction."));
        losses.push_back(
            make_loss("Motion scaled to the safe fraction", t.scaled_step_count,
                      fmt::format("in {}, to {:.0f} % at least", of_steps(t.scaled_step_count, record), 100.0 * t.smallest_safe_fraction),
                      Mark::Note, "Contacts were left after all corrections. A shorter step moves less at once."));
        losses.push_back(make_loss("Skin within the exact distance", t.within_distance,
                                   fmt::format("in {}", of_steps(t.within_distance, record)), Mark::Note,
                                   "Skin and wall were pressed nearer than that; the motion was proven not to touch."));
    }
    losses.push_back(loud(make_loss("Drive slowed", t.drive_limited_steps, fmt::format("in {}", of_steps(t.drive_limited_steps, record)),
                                    Mark::Note, "It moved less than the script asked for in one step. A shorter step lets it keep up.")));
    losses.push_back(loud(make_loss("Drive stopped", t.drive_stop_steps, fmt::format("in {}", of_steps(t.drive_stop_steps, record)),
                                    Mark::Note, "Its push met a wall; the script waited or drew back.")));
    losses.push_back(loud(make_loss("Forces cut", t.clamped_steps, fmt::format("in {}", of_steps(t.clamped_steps, record)), Mark::Note,
                                    "A wall was pressed harder than any tissue bears; the push on the tissue was limited.")));
    losses.push_back(make_loss("Instrument not proven free", t.unproven_steps, fmt::format("in {}", of_steps(t.unproven_steps, record)),
                               Mark::Note, "A larger budget lets the exact stage prove it."));
    losses.push_back(loud(make_loss("Instrument outside the lumen", t.lumen_exits,
                                    fmt::format("{} in {}, by an independent inside test", count_text(t.lumen_exits, "vertex", "vertices"),
                                                of_steps(t.exit_steps, record)),
                                    Mark::Bad, "A larger budget, a shorter step, or slower drive commands.")));
}

} // namespace

std::string scope_text(const BudgetSpec& budget) { return budget.scope == BudgetScope::Step ? "the whole step" : "contact"; }

std::string number_text(double value) {
    return std::abs(value) >= 1000.0 && std::abs(value) < 1e9 ? fmt::format("{:.0f}", value) : fmt::format("{:.3g}", value);
}

std::string count_text(std::uint64_t count, const char* singular, const char* plural) {
    return grouped(count) + " " + (count == 1 ? singular : plural);
}

Verdict make_verdict(const RunRecord& record) {
    Verdict verdict = budget_verdict(record);
    if (record.statistics.steps > 0) verdict.detail += " " + realtime_text(record);
    if (!record.summary.finite) {
        verdict.detail = fmt::format("{}. The last good state is in {}/. Until then: {} {}", record.summary.failure, record.last_good_state,
                                     verdict.headline, verdict.detail);
        verdict.headline = fmt::format("The run was stopped in step {}.", record.failed_step);
        verdict.mark = Mark::Bad;
    } else if (record.interrupted) {
        verdict.detail = "The run was interrupted by request. " + verdict.detail;
    }
    if (record.statistics.lumen_exits + record.statistics.unproven_solids > 0) verdict.mark = Mark::Bad;
    return verdict;
}

std::vector<Loss> list_losses(const RunRecord& record) {
    const RunStatistics& t = record.statistics;
    std::vector<Loss> losses;
    if (record.scene.budget.limits.mode == BudgetMode::Wall)
        losses.push_back(make_loss("Steps over the budget", t.overruns,
                                   fmt::format("{}, for {}", of_steps(t.overruns, record), scope_text(record.scene.budget)), Mark::Bad,
                                   fmt::format("{} at worst. A larger budget, or a less busy machine.", ms(t.worst_overrun_ms))));
    losses.push_back(make_loss(
        "Whole steps slower than real time", record.summary.realtime_overruns,
        fmt::format("{}, {} the slowest", of_steps(record.summary.realtime_overruns, record), ms(record.summary.step_ms.max)), Mark::Note,
        fmt::format("Each simulates {}. Less to simulate in a step, a longer step, or a budget with the scope \"step\".",
                    ms(1e3 * record.scene.time.step))));
    if (const RunSummary& s = record.summary; s.pace)
        losses.push_back(make_loss(
            "Steps that began late", s.pace_stats.late_steps,
            fmt::format("{}, by {} at worst", of_steps(s.pace_stats.late_steps, record),
                        ms(1e-6 * static_cast<double>(s.pace_stats.worst_late_ns))),
            Mark::Note,
            s.pace->late == LatePolicy::CatchUp
                ? std::string("The steps after them did not wait, until the run had caught up.")
                : fmt::format("The run fell behind real time: by {} s in the end. A slower pace, or less to do in a step.",
                              number_text(1e-9 * static_cast<double>(s.pace_stats.lost_ns)))));
    if (!record.scene.budget.drop.empty())
        losses.push_back(loud(make_loss("Effects left out", t.dropped_steps, fmt::format("in {}", of_steps(t.dropped_steps, record)),
                                        Mark::Note, "Their forecast did not fit in the step; the scene's budget says which go first.")));
    add_contact_losses(record, losses);
    bool tissue = false;
    for (const BodyModel& body : record.prepared.model.bodies) tissue = tissue || body.tissue.has_value();
    if (tissue)
        losses.push_back(loud(make_loss("Crushed elements", t.inverted_steps,
                                        fmt::format("up to {} in {}; smallest volume {:.3g} of rest",
                                                    count_text(t.inverted_tets, "tetrahedron", "tetrahedra"),
                                                    of_steps(t.inverted_steps, record), t.min_volume_ratio),
                                        Mark::Bad, "Softer contact, a shorter step, or a coarser mesh there.")));
    losses.push_back(make_loss("Numbers that are not finite", record.summary.finite ? 0 : 1, record.summary.failure, Mark::Bad,
                               "The run was stopped before they could spread."));
    return losses;
}

std::vector<std::string> list_warnings(const RunRecord& record) {
    std::vector<std::string> warnings;
    for (const Loss& loss : list_losses(record))
        if (loss.loud && loss.mark != Mark::Good) warnings.push_back(fmt::format("{}: {}. {}", loss.name, loss.amount, loss.advice));
    return warnings;
}

} // namespace trocar::engine
