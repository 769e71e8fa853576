#include "engine/step/tissue/tissue_stage.hpp"

#include "engine/effects/call.hpp"
#include "engine/effects/registry.hpp"
#include "engine/prepare/body_pairs.hpp"
#include "engine/prepare/scripted_motion.hpp"

#include <algorithm>

namespace trocar::engine {

void keep_bodies(const SceneModel& model, const State& state, BodiesScratch& bodies) {
    for (std::size_t i = 0; i < model.bodies.size(); ++i) {
        if (!model.bodies[i].moves()) continue;
        bodies.start[i].tissue = state.bodies[i].tissue;
        bodies.start[i].contact_work = state.bodies[i].contact_work;
    }
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
        state.bodies[i].contact_work = bodies.start[i].contact_work;
        if (bodies.start[i].may_wait) {
            fem::turn_frames(*model.bodies[i].links, bodies.start[owner_of(model, i)].tissue.position, state.bodies[i].frames);
            state.bodies[i].surface_deferred = true;
        } else {
            state.bodies[i].surface = bodies.start[i].surface;
        }
    }
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
