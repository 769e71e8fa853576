#include "fem/tissue/substep.hpp"

#include "fem/tissue/relaxation.hpp"

#include <cassert>

namespace trocar::fem {

namespace {

void prepare_workspace(const ForcePlan& plan, RkWorkspace& w) {
    for (std::vector<NodeRecord>* array : {&w.start, &w.stage, &w.slope}) array->resize(plan.node_count());
    w.partial.resize(plan.slots.size());
    w.extra.resize(plan.node_count());
    w.sums.resize(plan.chunks.size());
}

void add_pressures(std::span<const FacePressure> pressures, double time, const ForcePlan& plan, std::span<const NodeRecord> now, std::span<PartialForce> force) noexcept {
    for (const FacePressure& face : pressures) {
        const Index record[3] = {plan.record_of[face.nodes[0]], plan.record_of[face.nodes[1]], plan.record_of[face.nodes[2]]};
        const Vec3 a(now[record[0]].x), b(now[record[1]].x), c(now[record[2]].x);
        const Vec3 third = -face.at(time) / 6.0 * (b - a).cross(c - a);
        for (const Index node : record)
            for (int axis = 0; axis < 3; ++axis) force[node].f[axis] += third[axis];
    }
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
    assert(inputs.force_rate.empty() || inputs.force_rate.size() == inputs.external_force.size());
    assert(step > 0.0);
}

} // namespace

bool holds(const StableStepWorkspace& w, const SubstepLimits& limits, double growth) noexcept {
    const KeptGrowth kept = kept_growth(limits.integrator);
    return w.rates_age < limits.substeps_per_estimate && growth <= (w.rates_age < kLeastKept ? kept.at_once : kept.settled);
}

bool can_keep(const TissueModel& model, const StableStepWorkspace& w, const SubstepLimits& limits) noexcept {
    return w.rates_hold && w.warm && w.mode.size() == model.node_count() && w.notes.size() == model.plan.batches.size() &&
           holds(w, limits, 1.0);
}

StiffnessWatch make_watch(const ForcePlan& plan, StableStepWorkspace& w, bool derived) {
    w.notes.resize(plan.batches.size());
    return {{derived ? TetGrowth::Use::Note : TetGrowth::Use::Compare, w.notes.data()}};
}

bool find_forces(const Substep& s, std::span<const NodeRecord> now) noexcept {
    const TetKernel kernel = s.model.material.viscosity > 0.0 ? TetKernel::ViscousForce : TetKernel::Force;
    TetJob forces = make_tet_job(s.model, kernel, s.w.threads);
    if (s.watch) forces.growth = s.watch->growth;
    const Extremes tets = run_tets(s.model.plan, forces, now, s.w.partial);
    ++s.w.evaluations;
    if (s.watch && s.watch->trips(tets.high)) return false;
    if (!s.w.relaxed.empty()) add_relaxation_forces(s.model, now, s.w.relaxed, s.w.partial, s.w.threads);
    if (tets.low_place != kNoIndex) s.report.least_stage_ratio = std::min(s.report.least_stage_ratio, tets.low);
    return true;
}

const PartialForce* find_extra(const Substep& s, double since, std::span<const NodeRecord> now) noexcept {
    const bool pushed = !s.inputs.external_force.empty(), warm_springs = s.inputs.springs && !s.inputs.springs->springs.empty();
    if (!pushed && !warm_springs && s.inputs.pressures.empty()) return nullptr;
    const ForcePlan& plan = s.model.plan;
    for (std::size_t record = 0; record < plan.node_count(); ++record) {
        const Index node = plan.node_of[record];
        Vec3 force = pushed ? s.inputs.external_force[node] : Vec3(0.0, 0.0, 0.0);
        if (!s.inputs.force_rate.empty()) force += (s.time + since) * s.inputs.force_rate[node];
        s.w.extra[record] = {{force[0], force[1], force[2], 0.0}};
    }
    add_pressures(s.inputs.pressures, s.time + since, plan, now, s.w.extra);
    if (warm_springs) add_spring_forces(*s.inputs.springs, s.time + since, plan, now, s.w.extra);
    return s.w.extra.data();
}

StageOutcome update_stage(const Substep& s, double since, std::span<const NodeRecord> now, NodeUpdate update, double reach,
                          double drift) noexcept {
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
    const Index bad = update_nodes(s.model.plan, job);
    if (bad == kNoIndex) return StageOutcome::Fine;
    s.report.first_bad_node = bad;
    s.report.first_bad_tet = measure_tets(s.model, now, s.w.sums, 1).first_bad_tet;
    return StageOutcome::NotFinite;
}

void begin_substeps(const TissueModel& model, TissueState& state, double step, const IntegrateInputs& inputs, RkWorkspace& w,
           IntegrateReport& report) {
    check_sizes(model, state, step, inputs);
    prepare_workspace(model.plan, w);
    state.relaxed.resize(relaxation_size(model), 0.0);
    w.relaxed = state.relaxed;
    report.first_bad_node = find_bad_node(state);
    aim_pinned(model, state, step, inputs);
    gather_records(model.plan, state.position, state.velocity, w.start);
}

void follow_relaxation(const TissueModel& model, RkWorkspace& w, double h) noexcept {
    if (!w.relaxed.empty()) relax(model, w.start, h, w.relaxed, w.threads);
}

void finish_substeps(const TissueModel& model, TissueState& state, const IntegrateInputs& inputs, bool arrived, RkWorkspace& w,
            IntegrateReport& report) noexcept {
    if (arrived && !inputs.pinned_target.empty())
        for (std::size_t k = 0; k < model.pinned.size(); ++k)
            for (int axis = 0; axis < 3; ++axis) w.start[model.plan.record_of[model.pinned[k]]].x[axis] = inputs.pinned_target[k][axis];
    scatter_records(model.plan, w.start, state.position, state.velocity);
    measure_end(model, state, w, report);
}

} // namespace trocar::fem
