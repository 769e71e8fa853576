#include "engine/step/tissue_stage.hpp"

#include "base/trig.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace seldinger::engine {

namespace {

void find_pinned_targets(const SceneModel& model, const fem::TissueModel& tissue, double time,
                         std::vector<Vec3>& target) {
    target.clear();
    if (!model.effects.breathing) return;
    const Breathing& breathing = *model.effects.breathing;
    const Vec3 moved = breathing.amplitude * breath_at(breathing, time) * breathing.direction;
    for (const Index node : tissue.pinned) target.push_back(tissue.rest_position[node] + moved);
}

/// Sub-steps that stability asks for; 0 with the report's failure filled in when they cannot be taken.
unsigned plan_substeps(const SceneModel& model, const BodyModel& body, const BodyState& state, BodyScratch& scratch,
                       StepReport& report) {
    const fem::StableStep stable =
        fem::find_stable_step(*body.tissue, state.tissue.position, &scratch.springs, scratch.stable);
    const unsigned needed = fem::count_substeps(model.step_s, stable, model.max_substeps);
    if (needed == 0) {
        report.failure = fmt::format("{}: the stable step is {:.3g} s (tetrahedron {}), more than {} sub-steps of the "
                                     "step of {:g} s would be needed", body.name, stable.step, stable.worst_tet,
                                     model.max_substeps, model.step_s);
        return 0;
    }
    if (report.stable_step_s == 0.0 || stable.step < report.stable_step_s) report.stable_step_s = stable.step;
    return std::max(needed, model.fixed_substeps);
}

void integrate_body(const SceneModel& model, const BodyModel& body, double end_time, BodyState& state,
                    BodyScratch& scratch, StepReport& report) {
    const unsigned substeps = plan_substeps(model, body, state, scratch, report);
    if (substeps == 0) {
        report.finite = false;
        return;
    }
    find_pinned_targets(model, *body.tissue, end_time, scratch.pinned_target);
    fem::IntegrateInputs inputs;
    if (model.effects.gravity) inputs.gravity = *model.effects.gravity;
    inputs.springs = &scratch.springs;
    inputs.pinned_target = scratch.pinned_target;
    const fem::IntegrateReport done =
        fem::integrate_rk4(*body.tissue, state.tissue, model.step_s, substeps, inputs, scratch.rk);
    report.substeps = std::max(report.substeps, substeps);
    report.min_volume_ratio = std::min(report.min_volume_ratio, done.min_volume_ratio);
    report.inverted_tets += done.inverted;
    report.elastic_j += done.elastic_j;
    report.kinetic_j += done.kinetic_j;
    if (done.finite()) return;
    report.finite = false;
    report.failure = fmt::format("{}: node {} is not finite after {} of {} sub-steps (tetrahedron {}, smallest volume "
                                 "ratio {:.3g})", body.name, done.first_bad_node, done.substeps_done, substeps,
                                 done.first_bad_tet, done.min_volume_ratio);
}

} // namespace

Vec3 evaluate_motion(const std::vector<MotionRow>& path, double time) noexcept {
    if (path.empty()) return Vec3::Zero();
    if (time <= path.front().time) return path.front().displacement;
    for (std::size_t i = 1; i < path.size(); ++i) {
        if (time > path[i].time) continue;
        const double span = path[i].time - path[i - 1].time;
        const double s = span > 0.0 ? (time - path[i - 1].time) / span : 1.0;
        return path[i - 1].displacement + s * (path[i].displacement - path[i - 1].displacement);
    }
    return path.back().displacement;
}

double breath_at(const Breathing& breathing, double time) noexcept {
    const double turns = time / breathing.period;
    const double phase = 2.0 * std::numbers::pi * (turns - std::floor(turns));
    return 0.5 * (1.0 - sin_cos(phase).cos);
}

void keep_start(const SceneModel& model, const State& state, StepContext& context) {
    for (std::size_t i = 0; i < model.bodies.size(); ++i) {
        if (!model.bodies[i].moves()) continue;
        context.bodies[i].tissue_t0 = state.bodies[i].tissue;
        context.bodies[i].surface_t0 = state.bodies[i].surface;
    }
    for (std::size_t i = 0; i < model.instruments.size(); ++i) {
        context.instruments[i].rod_t0 = state.instruments[i].rod;
        context.instruments[i].skin_t0 = state.instruments[i].skin;
    }
}

void integrate_bodies(const SceneModel& model, State& state, StepContext& context) {
    if (!model.effects.elasticity) return;
    for (std::size_t i = 0; i < model.bodies.size() && context.report.finite; ++i)
        if (model.bodies[i].motion == Motion::Deformable)
            integrate_body(model, model.bodies[i], state.time + model.step_s, state.bodies[i], context.bodies[i],
                           context.report);
}

void steer_surfaces(const SceneModel& model, State& state, StepContext& context) {
    for (std::size_t i = 0; i < model.bodies.size(); ++i) {
        const BodyModel& body = model.bodies[i];
        std::vector<Vec3>& surface = state.bodies[i].surface;
        if (body.motion == Motion::Kinematic) {
            const Vec3 moved = evaluate_motion(body.path, state.time + model.step_s);
            for (std::size_t v = 0; v < surface.size(); ++v) surface[v] = body.surface.vertices[v] + moved;
        } else if (body.links) {
            const std::size_t owner = body.carrier != SIZE_MAX ? body.carrier : i;
            fem::steer(*body.links, state.bodies[owner].tissue.position, body.surface.vertices, context.bodies[i].frames,
                       surface);
        }
    }
}

} // namespace seldinger::engine
