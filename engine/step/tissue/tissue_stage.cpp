#include "engine/step/tissue/tissue_stage.hpp"

#include "engine/effects/call.hpp"
#include "engine/effects/registry.hpp"
#include "engine/prepare/body_pairs.hpp"
#include "engine/prepare/scripted_motion.hpp"
#include "engine/step/tissue/surface_spring.hpp"
#include "engine/step/tissue/waiting_springs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace trocar::engine {

namespace {

fem::AdvanceReport advance_body(const SceneModel& model, const BodyModel& body, const fem::IntegrateInputs& inputs, BodyState& state,
                                TissueScratch& scratch) {
    fem::SubstepLimits limits;
    limits.max_substeps = model.max_substeps;
    limits.integrator = model.integrator;
    if (model.fixed_substeps == 0)
        return fem::advance(*body.tissue, state.tissue, model.step_s, inputs, limits, scratch.rk, state.stable);
    // The scene insists on a number; preparation refused it where the body at rest would not stand it.
    fem::AdvanceReport done;
    done.tightest = fem::find_stable_step(*body.tissue, state.tissue.position, inputs.springs, state.stable, model.integrator);
    const unsigned needed = fem::count_substeps(model.step_s, done.tightest, model.max_substeps);
    done.refused = needed == 0;
    if (!done.refused)
        done.integrate = fem::integrate(*body.tissue, state.tissue, model.step_s, std::max(needed, model.fixed_substeps), inputs,
                                        model.integrator, scratch.rk);
    return done;
}

/// Empty while all went well.
std::string describe_failure(const SceneModel& model, const BodyModel& body, const fem::AdvanceReport& done) {
    const fem::IntegrateReport& end = done.integrate;
    if (done.refused) {
        const bool by_contact = done.tightest.omega_max > 2.0 * done.tightest.tissue_omega;
        return fmt::format("{}: the stable step is {:.3g} s, more than {} sub-steps of the step of {:g} s would be needed; {}", body.name,
                           done.tightest.step, model.max_substeps, model.step_s,
                           by_contact
                               ? std::string("what presses on it is stiffer than its tetrahedra. Softer contact (contact.wall_stiffness, "
                                             "contact.solid_stiffness), or a coarser coarse mesh")
                               : fmt::format("its tetrahedron {} is the stiffest, at a smallest volume of {:.3g} of rest. Fewer coarse "
                                             "triangles, the lattice mesher (coarse.mesher), or softer contact, if it is crushed",
                                             done.tightest.worst_tet, end.min_volume_ratio));
    }
    if (!end.finite())
        return fmt::format("{}: node {} is not finite after {} sub-steps (tetrahedron {}, smallest volume ratio {:.3g})", body.name,
                           end.first_bad_node, end.substeps_done, end.first_bad_tet, end.least_stage_ratio);
    return {};
}

/// What effects do to a body in this step.
void load_body(const EffectStep& step, std::size_t body, const State& state, TissueScratch& scratch, fem::IntegrateInputs& inputs) {
    scratch.pinned_target.clear();
    scratch.force.clear();
    TissueLoads loads{.pinned_target = scratch.pinned_target, .force = scratch.force};
    for (const EffectDescriptor* effect : registered_effects())
        if (effect->load_tissue != nullptr) call(*effect, step, [&](const EffectStep& own) { effect->load_tissue(own, body, state, loads); });
    inputs.gravity = loads.acceleration;
    inputs.pinned_target = scratch.pinned_target;
    inputs.external_force = scratch.force;
}

void integrate_body(const EffectStep& step, std::size_t body, State& state, TissueScratch& scratch) {
    fem::IntegrateInputs inputs;
    step.counts.note(effects::elasticity);
    load_body(step, body, state, scratch, inputs);
    inputs.springs = &active_springs(state.bodies[body], scratch);
    scratch.advanced = advance_body(step.model, step.model.bodies[body], inputs, state.bodies[body], scratch);
}

/// Adds what the body's integration came to.
void report_body(const SceneModel& model, const BodyModel& body, const fem::AdvanceReport& done, StepReport& report) {
    report.substeps = std::max(report.substeps, done.integrate.substeps_done);
    if (report.stable_step_s == 0.0 || done.tightest.step < report.stable_step_s) report.stable_step_s = done.tightest.step;
    report.min_volume_ratio = std::min(report.min_volume_ratio, done.integrate.min_volume_ratio);
    report.inverted_tets += done.integrate.inverted;
    report.elastic_j += done.integrate.elastic_j;
    report.kinetic_j += done.integrate.kinetic_j;
    report.failure = describe_failure(model, body, done);
    report.finite = report.failure.empty();
}

} // namespace

void keep_bodies(const SceneModel& model, const State& state, BodiesScratch& bodies) {
    for (std::size_t i = 0; i < model.bodies.size(); ++i)
        if (model.bodies[i].moves()) bodies.start[i].tissue = state.bodies[i].tissue;
}

void place_surface(const SceneModel& model, std::size_t i, State& state) noexcept {
    if (!state.bodies[i].surface_deferred) return;
    fem::place_vertices(*model.bodies[i].links, state.bodies[i].frames, model.bodies[i].surface.vertices, state.bodies[i].surface);
    state.bodies[i].surface_deferred = false;
}

void keep_surfaces(const SceneModel& model, State& state, BodiesScratch& bodies) {
    for (std::size_t i = 0; i < model.bodies.size(); ++i) {
        if (!model.bodies[i].moves() || bodies.start[i].may_wait) continue;
        std::vector<Vec3>&kept = bodies.start[i].surface, &surface = state.bodies[i].surface;
        if (kept.size() == surface.size())
            std::swap(kept, surface); // its vertices that never move stand in both
        else
            kept = surface; // the first step
    }
}

void restore_bodies(const SceneModel& model, State& state, const BodiesScratch& bodies) {
    for (std::size_t i = 0; i < model.bodies.size(); ++i) {
        if (!model.bodies[i].moves()) continue;
        state.bodies[i].tissue = bodies.start[i].tissue;
        if (bodies.start[i].may_wait) {
            fem::turn_frames(*model.bodies[i].links, bodies.start[owner_of(model, i)].tissue.position, state.bodies[i].frames);
            state.bodies[i].surface_deferred = true;
        } else {
            state.bodies[i].surface = bodies.start[i].surface;
        }
    }
}

void integrate_bodies(const SceneModel& model, const EffectSet& live, State& state, BodiesScratch& bodies, StepReport& report) {
    if (!live.elasticity) return;
    const auto integrate = [&](std::size_t i) {
        integrate_body({model, live, {}, state.time + model.step_s, report.effects}, i, state, bodies.tissue[i]);
    };
    const auto is_tissue = [&](std::size_t i) { return model.bodies[i].motion == Motion::Deformable; };
    for (std::size_t i = 0; i < model.bodies.size(); ++i)
        if (is_tissue(i)) choose_springs(model, i, state, bodies.tissue[i]); // before anything moves
    for (std::size_t i = 0; i < model.bodies.size(); ++i)
        if (is_tissue(i)) integrate(i);
    for (bool again = true; again;) { // each body once at most: what one that was put back does may press another
        again = false;
        for (std::size_t i = 0; i < model.bodies.size(); ++i)
            bodies.tissue[i].springs_met = bodies.tissue[i].springs_deferred && has_met(model, i, state);
        for (std::size_t i = 0; i < model.bodies.size(); ++i) {
            if (!bodies.tissue[i].springs_met) continue;
            again = true;
            bodies.tissue[i].springs_deferred = false;
            state.bodies[i].tissue = bodies.start[i].tissue;
            integrate(i);
        }
    }
    for (std::size_t i = 0; i < model.bodies.size() && report.finite; ++i)
        if (is_tissue(i)) report_body(model, model.bodies[i], bodies.tissue[i].advanced, report);
}

void update_embedded_surfaces(const SceneModel& model, const EffectSet& live, State& state, const BodiesScratch& bodies,
                              StepReport& report) {
    for (std::size_t i = 0; i < model.bodies.size(); ++i) {
        const BodyModel& body = model.bodies[i];
        std::vector<Vec3>& surface = state.bodies[i].surface;
        if (body.motion == Motion::Kinematic) {
            const Vec3 moved = evaluate_motion(body.path, state.time + model.step_s);
            for (std::size_t v = 0; v < surface.size(); ++v) surface[v] = body.surface.vertices[v] + moved;
        } else if (body.links) {
            BodyState& own = state.bodies[i];
            own.frames.leave_static = body.moves_by_links_alone();
            fem::turn_frames(*body.links, state.bodies[owner_of(model, i)].tissue.position, own.frames);
            own.surface_deferred = true;
            if (!bodies.start[i].may_wait) place_surface(model, i, state);
        } else if (body.moves()) {
            std::copy(body.surface.vertices.begin(), body.surface.vertices.end(), surface.begin());
        }
        if (state.bodies[i].surface_deferred || !body.moves()) continue;
        const EffectStep step{model, live, {}, state.time + model.step_s, report.effects};
        for (const EffectDescriptor* effect : registered_effects())
            if (effect->move_surface != nullptr) call(*effect, step, [&](const EffectStep& own) { effect->move_surface(own, i, surface); });
    }
}

} // namespace trocar::engine
