#include "fem/tissue/lockstep.hpp"

namespace trocar::fem {

TissueLockstep::TissueLockstep(const TissueModel& model, TissueState& state, double step, const IntegrateInputs& inputs,
                               const SubstepLimits& limits, RkWorkspace& workspace, StableStepWorkspace& stable)
    : model_(model), state_(state), step_(step), inputs_(inputs), limits_(limits), w_(workspace), stable_(stable) {
    limits_.integrator = Integrator::Leapfrog;
    begin_substeps(model_, state_, step_, inputs_, w_, report_.integrate);
}

double TissueLockstep::find_forces(double time, double taken) {
    if (!report_.integrate.finite()) return 0.0;
    time_ = time;
    if (taken > 0.0) follow_relaxation(model_, w_, taken);
    const Substep substep{model_, inputs_, w_, &watch_, report_.integrate, time};
    bool derive = taken == 0.0 ? !can_keep(model_, stable_, limits_) : !holds(stable_, limits_, watch_.largest);
    if (taken == 0.0) watch_ = make_watch(model_.plan, stable_, false);
    const bool bears = derive || fem::find_forces(substep, w_.start);
    const bool too_far = !derive && !bears && taken > 0.0;
    derive = derive || !bears || !holds(stable_, limits_, watch_.largest);
    if (derive) { // and note how stiff every tet is now
        if (stable_.rates_age < limits_.substeps_per_estimate) stable_.rounds_ahead = 0;
        now_ = find_stable_step(model_, w_.start, inputs_.springs, stable_, limits_.integrator);
        ++report_.estimates;
        watch_ = make_watch(model_.plan, stable_, true);
        (void)fem::find_forces(substep, w_.start);
        stable_.rates_hold = true;
    } else if (taken == 0.0) {
        now_ = find_stable_step_again(model_, inputs_.springs, stable_, limits_.integrator);
    }
    if (report_.tightest.step == 0.0 || now_.step < report_.tightest.step) report_.tightest = now_;
    report_.rejected += too_far;
    if (taken > 0.0) {
        ++report_.integrate.substeps_done;
        ++stable_.rates_age;
        report_.last_substep = taken;
    }
    return too_far ? std::min(now_.step, 0.5 * taken) : now_.step;
}

bool TissueLockstep::kick(double h) {
    const Substep substep{model_, inputs_, w_, nullptr, report_.integrate, time_};
    if (update_stage(substep, 0.0, w_.start, NodeUpdate::KickDrift, h, 0.0) != StageOutcome::Fine) return false;
    std::swap(w_.start, w_.stage);
    return true;
}

void TissueLockstep::drift(double h) noexcept {
    for (NodeRecord& node : w_.start)
        for (int axis = 0; axis < 3; ++axis) node.x[axis] += h * node.v[axis];
}

AdvanceReport TissueLockstep::finish(bool arrived, bool refused) {
    report_.refused = refused;
    report_.time_done = arrived ? step_ : time_;
    stable_.rates_hold = report_.integrate.finite() && holds(stable_, limits_, watch_.largest);
    finish_substeps(model_, state_, inputs_, arrived, w_, report_.integrate);
    return report_;
}

} // namespace trocar::fem
