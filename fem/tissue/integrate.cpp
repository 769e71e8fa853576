#include "fem/tissue/integrate.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace trocar::fem {

namespace {

void prepare_workspace(const ForcePlan& plan, RkWorkspace& w) {
    for (std::vector<NodeRecord>* array : {&w.start, &w.stage, &w.slope}) array->resize(plan.node_count());
    w.partial.resize(plan.slots.size());
    w.extra.resize(plan.node_count());
    w.sums.resize(plan.chunks.size());
}

enum class StageOutcome : std::uint8_t { Fine, NotFinite, Stiffened };

/// Detects that a tet has stiffened since the step was derived.
struct StiffnessWatch {
    TetGrowth growth;
    double largest = 1.0; // growth met so far
    [[nodiscard]] bool trips(double grown) noexcept {
        growth.use = TetGrowth::Use::Compare;
        largest = std::max(largest, grown);
        return grown > kRejectedGrowth;
    }
};

/// Whether the step of the last derivation still holds at a tet's largest growth since.
bool holds(const StableStepWorkspace& w, const SubstepLimits& limits, double growth) noexcept {
    const KeptGrowth kept = kept_growth(limits.integrator);
    return w.rates_age < limits.substeps_per_estimate && growth <= (w.rates_age < kLeastKept ? kept.at_once : kept.settled);
}

/// The same at the start of a call, of a body that may be another.
bool can_keep(const TissueModel& model, const StableStepWorkspace& w, const SubstepLimits& limits) noexcept {
    return w.rates_hold && w.warm && w.mode.size() == model.node_count() && w.notes.size() == model.plan.batches.size() &&
           holds(w, limits, 1.0);
}

/// Is the next derivation near enough, at this number of sub-steps per call, that one of its rounds should run now?
bool comes_near(const TissueModel& model, const StableStepWorkspace& w, const SubstepLimits& limits, unsigned substeps) noexcept {
    const int left = rounds_to_come(model, w);
    return left > 0 && w.rates_age + std::uint64_t{substeps} * static_cast<unsigned>(left) >= limits.substeps_per_estimate;
}

/// The first evaluation after a derivation notes how stiff every tet is, all others compare.
StiffnessWatch make_watch(const ForcePlan& plan, StableStepWorkspace& w, bool derived) {
    w.notes.resize(plan.batches.size());
    return {{derived ? TetGrowth::Use::Note : TetGrowth::Use::Compare, w.notes.data()}};
}

/// Inputs of a sub-step.
struct Substep {
    const TissueModel& model;
    const IntegrateInputs& inputs;
    RkWorkspace& w;
    StiffnessWatch* watch; // may be null
    IntegrateReport& report;
    double time = 0.0; // s, of its start, since the springs were made
};

/// Springs and external forces at `now`, `since` the sub-step's start; null where there are none.
const PartialForce* find_extra(const Substep& s, double since, std::span<const NodeRecord> now) noexcept {
    const bool pushed = !s.inputs.external_force.empty(), warm_springs = s.inputs.springs && !s.inputs.springs->springs.empty();
    if (!pushed && !warm_springs) return nullptr;
    const ForcePlan& plan = s.model.plan;
    for (std::size_t record = 0; record < plan.node_count(); ++record) {
        const Vec3 force = pushed ? s.inputs.external_force[plan.node_of[record]] : Vec3(0.0, 0.0, 0.0);
        s.w.extra[record] = {{force[0], force[1], force[2], 0.0}};
    }
    if (warm_springs) add_spring_forces(*s.inputs.springs, s.time + since, plan, now, s.w.extra);
    return s.w.extra.data();
}

/// Forces at `now`, which stands for `since` (s) after the sub-step's start, then every node's update. Not Fine: the report names the bad
/// node and tet; w.start is as it was.
StageOutcome run_stage(const Substep& s, double since, std::span<const NodeRecord> now, NodeUpdate update, double reach,
                       double drift) noexcept {
    const ForcePlan& plan = s.model.plan;
    const TetKernel kernel = s.model.material.viscosity > 0.0 ? TetKernel::ViscousForce : TetKernel::Force;
    TetJob forces = make_tet_job(s.model, kernel, s.w.threads);
    if (s.watch) forces.growth = s.watch->growth;
    const Extremes tets = run_tets(plan, forces, now, s.w.partial);
    if (s.watch && s.watch->trips(tets.high)) return StageOutcome::Stiffened;
    if (tets.low_place != kNoIndex) s.report.least_stage_ratio = std::min(s.report.least_stage_ratio, tets.low);
    NodeJob job{.update = update,
                .start = s.w.start.data(),
                .now = now.data(),
                .out = s.w.stage.data(),
                .slope = s.w.slope.data(),
                .partial = s.w.partial.data(),
                .extra = find_extra(s, since, now)};
    for (int axis = 0; axis < 3; ++axis) job.gravity[axis] = s.inputs.gravity[axis];
    job.mass_damping = s.model.material.mass_damping;
    job.reach = reach;
    job.drift = drift;
    job.threads = s.w.threads;
    const Index bad = update_nodes(plan, job);
    if (bad == kNoIndex) return StageOutcome::Fine;
    s.report.first_bad_node = bad;
    s.report.first_bad_tet = measure_tets(s.model, now, s.w.sums, 1).first_bad_tet;
    return StageOutcome::NotFinite;
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
    return integrator == Integrator::Rk4 ? take_rk4(s, h) : take_leapfrog(s, h);
}

/// Pinned nodes have no acceleration, so that the velocity set here carries them linearly to their target.
void aim_pinned(const TissueModel& model, TissueState& state, double step, const IntegrateInputs& inputs) noexcept {
    for (std::size_t k = 0; k < model.pinned.size(); ++k) {
        const Index node = model.pinned[k];
        if (inputs.pinned_target.empty())
            state.velocity[node].setZero();
        else
            state.velocity[node] = (inputs.pinned_target[k] - state.position[node]) / step;
    }
}

void measure_end(const TissueModel& model, const TissueState& state, RkWorkspace& w, IntegrateReport& report) noexcept {
    const TetReport tets = measure_tets(model, w.start, w.sums, w.threads);
    report.min_volume_ratio = tets.min_volume_ratio;
    report.min_volume_tet = tets.min_volume_tet;
    report.least_stage_ratio = std::min(report.least_stage_ratio, tets.min_volume_ratio);
    report.inverted = tets.inverted;
    report.elastic_j = tets.elastic_energy;
    for (std::size_t node = 0; node < model.node_count(); ++node)
        report.kinetic_j += 0.5 * model.node_mass[node] * state.velocity[node].squaredNorm();
}

/// A state that arrives broken is reported before it spreads.
Index find_bad_node(const TissueState& state) noexcept {
    for (std::size_t node = 0; node < state.position.size(); ++node)
        if (!is_finite(state.position[node]) || !is_finite(state.velocity[node])) return static_cast<Index>(node);
    return kNoIndex;
}

void check_sizes([[maybe_unused]] const TissueModel& model, [[maybe_unused]] const TissueState& state, [[maybe_unused]] double step,
                 [[maybe_unused]] const IntegrateInputs& inputs) noexcept {
    assert(state.position.size() == model.node_count() && state.velocity.size() == model.node_count());
    assert(inputs.pinned_target.empty() || inputs.pinned_target.size() == model.pinned.size());
    assert(inputs.external_force.empty() || inputs.external_force.size() == model.node_count());
    assert(step > 0.0);
}

void begin(const TissueModel& model, TissueState& state, double step, const IntegrateInputs& inputs, RkWorkspace& w,
           IntegrateReport& report) {
    check_sizes(model, state, step, inputs);
    prepare_workspace(model.plan, w);
    report.first_bad_node = find_bad_node(state);
    aim_pinned(model, state, step, inputs);
    gather_records(model.plan, state.position, state.velocity, w.start);
}

/// Sets pinned nodes exactly to their targets, and computes the end's energies.
void finish(const TissueModel& model, TissueState& state, const IntegrateInputs& inputs, bool arrived, RkWorkspace& w,
            IntegrateReport& report) noexcept {
    if (arrived && !inputs.pinned_target.empty())
        for (std::size_t k = 0; k < model.pinned.size(); ++k)
            for (int axis = 0; axis < 3; ++axis) w.start[model.plan.record_of[model.pinned[k]]].x[axis] = inputs.pinned_target[k][axis];
    scatter_records(model.plan, w.start, state.position, state.velocity);
    measure_end(model, state, w, report);
}

} // namespace

IntegrateReport integrate(const TissueModel& model, TissueState& state, double step, unsigned substeps, const IntegrateInputs& inputs,
                          Integrator integrator, RkWorkspace& w) noexcept {
    assert(substeps > 0);
    IntegrateReport report;
    begin(model, state, step, inputs, w, report);
    const double h = step / substeps;
    while (report.finite() && report.substeps_done < substeps &&
           take_substep({model, inputs, w, nullptr, report, report.substeps_done * h}, h, integrator) == StageOutcome::Fine)
        ++report.substeps_done;
    finish(model, state, inputs, report.finite(), w, report);
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
    begin(model, state, step, inputs, w, done);
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
            spent < limits.max_substeps ? count_substeps(left, {.step = std::min(stable.step, cap)}, limits.max_substeps - spent) : 0;
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
    finish(model, state, inputs, left == 0.0, w, done);
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
