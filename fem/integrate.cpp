#include "fem/integrate.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace seldinger::fem {

namespace {

/// An acceleration beyond this is counted as not finite: its square must still be a double.
constexpr double kAccelerationLimit = 1e150; // m/s^2

void prepare_workspace(std::size_t count, RkWorkspace& w) {
    for (std::vector<Vec3>* array : {&w.start_position, &w.start_velocity, &w.stage_position, &w.stage_velocity, &w.force,
                                     &w.slope_position, &w.slope_velocity})
        array->resize(count);
}

void note_volume(IntegrateReport& report, const TetReport& tets) noexcept {
    if (report.min_volume_tet != kNoIndex && !(tets.min_volume_ratio < report.min_volume_ratio)) return;
    report.min_volume_ratio = tets.min_volume_ratio;
    report.min_volume_tet = tets.min_volume_tet;
}

enum class StageOutcome : std::uint8_t { Fine, NotFinite, Stiffened };

/// Sees a tet stiffen since the step was derived. The step keeps 17 % in hand; the frequency grows with the root of this.
constexpr double kStiffnessGrowth = 1.3;
struct StiffnessWatch {
    double reference = 0.0; // of the first stage after the estimate; 0: not seen yet
    [[nodiscard]] bool trips(double stiffest) noexcept {
        if (reference == 0.0) reference = stiffest;
        return stiffest > kStiffnessGrowth * reference;
    }
};

/// Fills w.force with accelerations. NotFinite: the report names the bad node and tet. watch may be null.
StageOutcome find_accelerations(const TissueModel& model, const IntegrateInputs& inputs, std::span<const Vec3> position,
                                std::span<const Vec3> velocity, RkWorkspace& w, StiffnessWatch* watch,
                                IntegrateReport& report) noexcept {
    for (Vec3& f : w.force) f.setZero();
    const TetReport tets = add_tet_forces(model, position, velocity, w.force);
    if (watch && watch->trips(tets.stiffest)) return StageOutcome::Stiffened;
    note_volume(report, tets);
    if (inputs.springs) add_spring_forces(*inputs.springs, position, velocity, w.force);
    const bool pushed = !inputs.external_force.empty();
    const double damping = model.material.mass_damping;
    for (std::size_t node = 0; node < w.force.size(); ++node) {
        const double inv_mass = model.inv_mass[node];
        if (inv_mass == 0.0) {
            w.force[node].setZero();
            continue;
        }
        if (pushed) w.force[node] += inputs.external_force[node];
        w.force[node] = inv_mass * w.force[node] + inputs.gravity - damping * velocity[node];
        if (w.force[node].cwiseAbs().maxCoeff() < kAccelerationLimit && w.force[node].allFinite()) continue;
        report.first_bad_node = static_cast<Index>(node);
        report.first_bad_tet = measure_tets(model, position).first_bad_tet;
        return StageOutcome::NotFinite;
    }
    return StageOutcome::Fine;
}

/// Stage state = start + reach * (stage velocity, acceleration). velocity may be the stage's own: it is read first.
void move_stage(RkWorkspace& w, std::span<const Vec3> velocity, double reach) noexcept {
    for (std::size_t node = 0; node < w.force.size(); ++node) {
        w.stage_position[node] = w.start_position[node] + reach * velocity[node];
        w.stage_velocity[node] = w.start_velocity[node] + reach * w.force[node];
    }
}

void add_slope(RkWorkspace& w, std::span<const Vec3> velocity, double weight) noexcept {
    for (std::size_t node = 0; node < w.force.size(); ++node) {
        w.slope_position[node] += weight * velocity[node];
        w.slope_velocity[node] += weight * w.force[node];
    }
}

/// One RK4 sub-step. Anything but Fine: the state was left as it was.
StageOutcome take_substep(const TissueModel& model, TissueState& state, double h, const IntegrateInputs& inputs, RkWorkspace& w,
                          StiffnessWatch* watch, IntegrateReport& report) noexcept {
    w.start_position = state.position;
    w.start_velocity = state.velocity;
    StageOutcome outcome = find_accelerations(model, inputs, state.position, state.velocity, w, watch, report);
    if (outcome != StageOutcome::Fine) return outcome;
    w.slope_position = state.velocity;
    w.slope_velocity = w.force;
    move_stage(w, state.velocity, 0.5 * h);
    for (const double reach : {0.5 * h, h}) {
        outcome = find_accelerations(model, inputs, w.stage_position, w.stage_velocity, w, watch, report);
        if (outcome != StageOutcome::Fine) return outcome;
        add_slope(w, w.stage_velocity, 2.0);
        move_stage(w, w.stage_velocity, reach);
    }
    outcome = find_accelerations(model, inputs, w.stage_position, w.stage_velocity, w, watch, report);
    if (outcome != StageOutcome::Fine) return outcome;
    add_slope(w, w.stage_velocity, 1.0);
    for (std::size_t node = 0; node < w.force.size(); ++node) {
        state.position[node] = w.start_position[node] + h / 6.0 * w.slope_position[node];
        state.velocity[node] = w.start_velocity[node] + h / 6.0 * w.slope_velocity[node];
    }
    return StageOutcome::Fine;
}

/// Pinned nodes have no acceleration, so that the velocity set here carries them linearly to their target.
void aim_pinned(const TissueModel& model, TissueState& state, double step, const IntegrateInputs& inputs) noexcept {
    for (std::size_t k = 0; k < model.pinned.size(); ++k) {
        const Index node = model.pinned[k];
        if (inputs.pinned_target.empty()) state.velocity[node].setZero();
        else state.velocity[node] = (inputs.pinned_target[k] - state.position[node]) / step;
    }
}

void measure_end(const TissueModel& model, const TissueState& state, IntegrateReport& report) noexcept {
    const TetReport tets = measure_tets(model, state.position);
    note_volume(report, tets);
    report.inverted = tets.inverted;
    report.elastic_j = tets.elastic_energy;
    for (std::size_t node = 0; node < model.node_count(); ++node)
        report.kinetic_j += 0.5 * model.node_mass[node] * state.velocity[node].squaredNorm();
}

/// A state that arrives broken is reported before anything spreads from it.
Index find_bad_node(const TissueState& state) noexcept {
    for (std::size_t node = 0; node < state.position.size(); ++node)
        if (!is_finite(state.position[node]) || !is_finite(state.velocity[node])) return static_cast<Index>(node);
    return kNoIndex;
}

} // namespace

namespace {

void check_sizes([[maybe_unused]] const TissueModel& model, [[maybe_unused]] const TissueState& state,
                 [[maybe_unused]] double step, [[maybe_unused]] const IntegrateInputs& inputs) noexcept {
    assert(state.position.size() == model.node_count() && state.velocity.size() == model.node_count());
    assert(inputs.pinned_target.empty() || inputs.pinned_target.size() == model.pinned.size());
    assert(inputs.external_force.empty() || inputs.external_force.size() == model.node_count());
    assert(step > 0.0);
}

void begin(const TissueModel& model, TissueState& state, double step, const IntegrateInputs& inputs, RkWorkspace& w,
           IntegrateReport& report) {
    check_sizes(model, state, step, inputs);
    prepare_workspace(model.node_count(), w);
    report.first_bad_node = find_bad_node(state);
    aim_pinned(model, state, step, inputs);
}

/// Pinned nodes to the last bit where they were sent, and the end's energies.
void finish(const TissueModel& model, TissueState& state, const IntegrateInputs& inputs, bool arrived,
            IntegrateReport& report) noexcept {
    if (arrived && !inputs.pinned_target.empty())
        for (std::size_t k = 0; k < model.pinned.size(); ++k) state.position[model.pinned[k]] = inputs.pinned_target[k];
    measure_end(model, state, report);
}

} // namespace

IntegrateReport integrate_rk4(const TissueModel& model, TissueState& state, double step, unsigned substeps,
                              const IntegrateInputs& inputs, RkWorkspace& w) noexcept {
    assert(substeps > 0);
    IntegrateReport report;
    begin(model, state, step, inputs, w, report);
    const double h = step / substeps;
    while (report.finite() && report.substeps_done < substeps &&
           take_substep(model, state, h, inputs, w, nullptr, report) == StageOutcome::Fine)
        ++report.substeps_done;
    finish(model, state, inputs, report.finite(), report);
    return report;
}

AdvanceReport advance(const TissueModel& model, TissueState& state, double step, const IntegrateInputs& inputs,
                      const SubstepLimits& limits, RkWorkspace& w, StableStepWorkspace& stable_workspace) {
    AdvanceReport report;
    IntegrateReport& done = report.integrate;
    begin(model, state, step, inputs, w, done);
    double left = step, cap = std::numeric_limits<double>::infinity();
    while (done.finite() && left > 0.0) {
        const StableStep stable = find_stable_step(model, state.position, inputs.springs, stable_workspace);
        if (report.estimates++ == 0 || stable.step < report.tightest.step) report.tightest = stable;
        const unsigned spent = done.substeps_done + report.rejected;
        const unsigned wanted =
            spent < limits.max_substeps ? count_substeps(left, {.step = std::min(stable.step, cap)}, limits.max_substeps - spent) : 0;
        report.refused = wanted == 0;
        if (report.refused) break;
        const double h = left / wanted;
        StiffnessWatch watch;
        StageOutcome outcome = StageOutcome::Fine;
        unsigned taken = 0;
        while (taken < wanted && taken < limits.substeps_per_estimate && outcome == StageOutcome::Fine) {
            outcome = take_substep(model, state, h, inputs, w, &watch, done);
            if (outcome == StageOutcome::Fine) ++taken;
        }
        done.substeps_done += taken;
        left = taken == wanted ? 0.0 : left - taken * h;
        if (outcome == StageOutcome::NotFinite) break;
        // stiffened within the very first sub-step: it moves too far at once; later ones only need a new estimate
        const bool too_far = outcome == StageOutcome::Stiffened && taken == 0;
        cap = too_far ? 0.5 * h : std::numeric_limits<double>::infinity();
        if (outcome == StageOutcome::Stiffened) ++report.rejected;
    }
    report.time_done = step - left;
    finish(model, state, inputs, left == 0.0, done);
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

} // namespace seldinger::fem
