#include "fem/tissue/integrate.hpp"

#include "fem/tissue/substep.hpp"

#include <cassert>
#include <limits>

namespace trocar::fem {

namespace {

/// Is the next derivation near enough, at this number of sub-steps per call, that one of its rounds should run now?
bool comes_near(const TissueModel& model, const StableStepWorkspace& w, const SubstepLimits& limits, unsigned substeps) noexcept {
    const int left = rounds_to_come(model, w);
    return left > 0 && w.rates_age + std::uint64_t{substeps} * static_cast<unsigned>(left) >= limits.substeps_per_estimate;
}

/// Forces at `now`, which stands for `since` (s) after the sub-step's start, then every node's update. Not Fine: w.start is as it was.
StageOutcome run_stage(const Substep& s, double since, std::span<const NodeRecord> now, NodeUpdate update, double reach,
                       double drift) noexcept {
    return find_forces(s, now) ? update_stage(s, since, now, update, reach, drift) : StageOutcome::Stiffened;
}

StageOutcome take_rk4(const Substep& s, double h) noexcept {
    struct Stage {
        NodeUpdate update;
        double since, reach;
    };
    const Stage stages[4] = {{NodeUpdate::FirstStage, 0.0, 0.5 * h},
                             {NodeUpdate::MiddleStage, 0.5 * h, 0.5 * h},
                             {NodeUpdate::MiddleStage, 0.5 * h, h},
                             {NodeUpdate::LastStage, h, h / 6.0}};
    std::span<const NodeRecord> now = s.w.start;
    for (const Stage& stage : stages) {
        const StageOutcome outcome = run_stage(s, stage.since, now, stage.update, stage.reach, 0.0);
        if (outcome != StageOutcome::Fine) return outcome;
        now = s.w.stage;
    }
    std::swap(s.w.start, s.w.stage);
    return StageOutcome::Fine;
}

StageOutcome take_leapfrog(const Substep& s, double h) noexcept {
    for (std::size_t record = 0; record < s.w.start.size(); ++record) {
        const NodeRecord& from = s.w.start[record];
        NodeRecord& to = s.w.stage[record];
        to = from;
        for (int axis = 0; axis < 3; ++axis) to.x[axis] += 0.5 * h * from.v[axis];
    }
    const StageOutcome outcome = run_stage(s, 0.5 * h, s.w.stage, NodeUpdate::KickDrift, h, 0.5 * h);
    if (outcome == StageOutcome::Fine) std::swap(s.w.start, s.w.stage);
    return outcome;
}

/// One sub-step of w.start. Anything but Fine: it was left as it was.
StageOutcome take_substep(const Substep& s, double h, Integrator integrator) noexcept {
    const StageOutcome outcome = integrator == Integrator::Rk4 ? take_rk4(s, h) : take_leapfrog(s, h);
    if (outcome == StageOutcome::Fine) follow_relaxation(s.model, s.w, h);
    return outcome;
}

} // namespace

IntegrateReport integrate(const TissueModel& model, TissueState& state, double step, unsigned substeps, const IntegrateInputs& inputs,
                          Integrator integrator, RkWorkspace& w) noexcept {
    assert(substeps > 0);
    IntegrateReport report;
    begin_substeps(model, state, step, inputs, w, report);
    const double h = step / substeps;
    while (report.finite() && report.substeps_done < substeps &&
           take_substep({model, inputs, w, nullptr, report, report.substeps_done * h}, h, integrator) == StageOutcome::Fine)
        ++report.substeps_done;
    finish_substeps(model, state, inputs, report.finite(), w, report);
    return report;
}

IntegrateReport integrate_rk4(const TissueModel& model, TissueState& state, double step, unsigned substeps, const IntegrateInputs& inputs,
                              RkWorkspace& w) noexcept {
    return integrate(model, state, step, substeps, inputs, Integrator::Rk4, w);
}

IntegrateReport integrate_leapfrog(const TissueModel& model, TissueState& state, double step, unsigned substeps,
                                   const IntegrateInputs& inputs, RkWorkspace& w) noexcept {
    return integrate(model, state, step, substeps, inputs, Integrator::Leapfrog, w);
}

AdvanceReport advance(const TissueModel& model, TissueState& state, double step, const IntegrateInputs& inputs, const SubstepLimits& limits,
                      RkWorkspace& w, StableStepWorkspace& stable_workspace) {
    AdvanceReport report;
    IntegrateReport& done = report.integrate;
    begin_substeps(model, state, step, inputs, w, done);
    constexpr double kNone = std::numeric_limits<double>::infinity();
    double left = step, cap = kNone;
    while (done.finite() && left > 0.0) {
        const bool derive = !can_keep(model, stable_workspace, limits);
        // after stiffening, all rounds are taken anew, not those from before
        if (derive && stable_workspace.rates_age < limits.substeps_per_estimate) stable_workspace.rounds_ahead = 0;
        const StableStep stable = derive ? find_stable_step(model, w.start, inputs.springs, stable_workspace, limits.integrator)
                                         : find_stable_step_again(model, inputs.springs, stable_workspace, limits.integrator);
        if (derive) ++report.estimates;
        if (report.tightest.step == 0.0 || stable.step < report.tightest.step) report.tightest = stable;
        const unsigned spent = done.substeps_done + report.rejected;
        const unsigned wanted =
            spent < limits.max_substeps ? count_substeps(left, {.step = std::min({stable.step, cap, limits.longest})}, limits.max_substeps - spent) : 0;
        report.refused = wanted == 0;
        if (report.refused) break;
        if (!derive && comes_near(model, stable_workspace, limits, wanted)) derive_ahead(model, w.start, stable_workspace);
        const double h = left / wanted;
        StiffnessWatch watch = make_watch(model.plan, stable_workspace, derive);
        StageOutcome outcome = StageOutcome::Fine;
        unsigned taken = 0;
        while (taken < wanted && outcome == StageOutcome::Fine && holds(stable_workspace, limits, watch.largest)) {
            outcome = take_substep({model, inputs, w, &watch, done, (step - left) + taken * h}, h, limits.integrator);
            if (outcome == StageOutcome::Fine) ++taken, ++stable_workspace.rates_age;
        }
        stable_workspace.rates_hold = outcome == StageOutcome::Fine && holds(stable_workspace, limits, watch.largest);
        done.substeps_done += taken;
        if (taken > 0) report.last_substep = h;
        left = taken == wanted ? 0.0 : left - taken * h;
        if (outcome == StageOutcome::NotFinite) break;
        // stiffened within the very first sub-step of a fresh step: it moves too far at once; otherwise a new one is all it needs
        const bool too_far = outcome == StageOutcome::Stiffened && taken == 0 && derive;
        cap = too_far ? 0.5 * h : kNone;
        if (outcome == StageOutcome::Stiffened) ++report.rejected;
    }
    report.time_done = step - left;
    finish_substeps(model, state, inputs, left == 0.0, w, done);
    return report;
}

Momentum find_momentum(const TissueModel& model, const TissueState& state) noexcept {
    Momentum sum;
    for (std::size_t node = 0; node < model.node_count(); ++node) {
        const Vec3 momentum = model.node_mass[node] * state.velocity[node];
        sum.linear += momentum;
        sum.angular += state.position[node].cross(momentum);
    }
    return sum;
}

} // namespace trocar::fem
