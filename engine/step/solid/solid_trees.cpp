#include "engine/step/solid/solid_trees.hpp"

#include "engine/prepare/body_pairs.hpp"
#include "engine/prepare/scripted_motion.hpp"
#include "engine/step/tissue/surface_place.hpp"
#include "engine/step/tissue/surface_spring.hpp"
#include "engine/step/solid/surface_travel.hpp"
#include "fem/tissue/integrate.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::engine {

namespace {

void read_turns(const fem::LinkFrames& frames, std::vector<Mat3>& turns) {
    turns.resize(frames.frame.size());
    for (std::size_t f = 0; f < turns.size(); ++f)
        for (Eigen::Index column = 0; column < 3; ++column)
            for (Eigen::Index row = 0; row < 3; ++row) turns[f](row, column) = frames.frame[f].turn[column][row];
}

void follow_wrapped(const SceneModel& model, std::size_t i, const State& state, SolidScratch& solids) {
    const BodyModel& body = model.bodies[i];
    SolidBodyScratch& scratch = solids.bodies[i];
    const std::size_t owner = owner_of(model, i);
    const spheretree::SphereUpdate update =
        model.contact.sphere_trees == SphereTrees::Heuristic ? spheretree::SphereUpdate::Heuristic : spheretree::SphereUpdate::Conservative;
    scratch.wrapped.begin(*body.wrapped, update, {state.bodies[owner].tissue.position, scratch.turn_t1},
                          {scratch.nodes_t0, scratch.turn_t0},
                          longest_way(scratch.surface_t0, state.bodies[i].surface) + scratch.change.norm());
}

/// Wrapped trees of bodies without coarse nodes go where the body is carried, as a whole.
void carry_wrapped(const BodyModel& body, std::span<const Vec3> before, std::span<const Vec3> now, const Vec3& change,
                   std::vector<spheretree::Sphere>& spheres) {
    spheres = body.covering.tree.spheres;
    if (now.empty()) return;
    const Vec3 moved = now.front() - body.surface.vertices.front();
    const double way = 2.0 * (now.front() - before.front()).norm() + change.norm() + 0x1p-48 * moved.norm(); // there, and on
    for (spheretree::Sphere& s : spheres) {
        s.centre += moved;
        if (s.radius >= 0.0) s.radius += way;
    }
}

/// Its spheres are fitted to the surface in each step: those of other trees were fitted once, and are carried.
bool is_covering(const BodyModel& body) noexcept { return !body.covering.vertex_begin.empty(); }

/// Its spheres are found one by one, in `wrapped`.
bool is_lazy(const SolidBodyScratch& scratch) noexcept { return !scratch.wrapped.spheres().empty(); }

/// A motion that all of what is compared may share: nothing comes nearer by it.
struct SharedMotion {
    Vec3 last = Vec3::Zero(), next = Vec3::Zero(); // m, in this step and in the next one
};

void follow_corners(const BodyModel& body, std::span<const Vec3> before, std::span<const Vec3> now, const SharedMotion& shared,
                    SolidBodyScratch& scratch, std::vector<spheretree::Sphere>& spheres) {
    scratch.surface_behind.resize(now.size());
    scratch.surface_ahead.resize(now.size());
    for (std::size_t v = 0; v < now.size(); ++v) {
        scratch.surface_behind[v] = before[v] + shared.last;
        scratch.surface_ahead[v] = now[v] + (now[v] - before[v]) + scratch.change - shared.next;
    }
    spheretree::update_covering_spheres(body.covering, scratch.surface_behind, scratch.surface_ahead, spheres);
}

/// The body's own mean motion, and what is known of the next step's.
SharedMotion find_shared(std::span<const Vec3> before, std::span<const Vec3> now, const SolidBodyScratch& scratch) {
    const Vec3 mean = find_motion(before, now).mean;
    return {mean, mean + scratch.change};
}

/// What all solids are seen from: the first, where nothing holds any of them. A scene that flies as a whole so finds the same pairs as one
/// at rest. Spheres that are carried hold what moves as it does: beside one of those nothing is seen from elsewhere.
SharedMotion find_common_motion(const SceneModel& model, const State& state, const SolidScratch& solids) {
    if (!are_all_free(model)) return {};
    if (model.contact.sphere_trees == SphereTrees::Covering)
        for (std::size_t i = 0; i < model.bodies.size(); ++i)
            if (can_touch_any(model, i) && !is_covering(model.bodies[i])) return {};
    for (std::size_t i = 0; i < model.bodies.size(); ++i)
        if (can_touch_any(model, i)) return find_shared(solids.bodies[i].surface_t0, state.bodies[i].surface, solids.bodies[i]);
    return {};
}

/// What is known of a body's next step: where its path takes it, and by how much that differs from the last one, as falling flesh does
/// by gravity. Of how flesh is pushed nothing is known.
/// starts   there was no step: what it is thrown with is news
void look_ahead(const SceneModel& model, std::size_t i, const State& state, const std::optional<Vec3>& gravity, bool starts,
                SolidBodyScratch& scratch) {
    const double h = model.step_s, now = state.time + h; // the state's time is that of the step's start
    scratch.coming = scratch.change = scratch.fall = Vec3::Zero();
    if (model.bodies[i].motion == Motion::Kinematic) {
        const std::vector<MotionRow>& path = model.bodies[i].path;
        const Vec3 at = evaluate_motion(path, now);
        scratch.coming = evaluate_motion(path, now + h) - at;
        scratch.change = scratch.coming - (at - evaluate_motion(path, state.time));
    } else if (model.bodies[owner_of(model, i)].tissue && gravity) {
        scratch.change = scratch.fall = h * h * *gravity;
    }
    if (const std::size_t owner = owner_of(model, i); starts && model.bodies[owner].tissue) {
        const fem::TissueModel& tissue = *model.bodies[owner].tissue;
        scratch.change += (h / tissue.mass) * fem::find_momentum(tissue, state.bodies[owner].tissue).linear;
    }
}

} // namespace

void update_solid_trees(const SceneModel& model, const State& state, const std::optional<Vec3>& gravity, SolidScratch& solids, bool starts) {
    for (std::size_t i = 0; i < model.bodies.size(); ++i)
        if (can_touch_any(model, i) && model.bodies[i].moves()) look_ahead(model, i, state, gravity, starts, solids.bodies[i]);
    const SharedMotion common = find_common_motion(model, state, solids);
    solids.shared = common.last;
    for (std::size_t i = 0; i < model.bodies.size(); ++i) {
        const BodyModel& body = model.bodies[i];
        SolidBodyScratch& scratch = solids.bodies[i];
        if (!can_touch_any(model, i) || (!body.moves() && !scratch.spheres.empty())) continue;
        const std::span<const Vec3> now = state.bodies[i].surface;
        const std::span<const Vec3> before = body.moves() ? scratch.surface_t0 : now;
        if (body.wrapped) {
            read_turns(state.bodies[i].frames, scratch.turn_t1);
            follow_wrapped(model, i, state, solids);
        } else if (!is_covering(body)) {
            carry_wrapped(body, before, now, scratch.change, scratch.spheres);
        } else {
            follow_corners(body, before, now, common, scratch, scratch.spheres);
            if (touches_itself(model, i))
                follow_corners(body, before, now, find_shared(before, now, scratch), scratch, scratch.self_spheres);
        }
    }
}

bool has_spheres(const SolidScratch& solids, std::size_t body) noexcept {
    return is_lazy(solids.bodies[body]) || !solids.bodies[body].spheres.empty();
}

spheretree::SolidView view_solid(const SceneModel& model, std::size_t body, SolidScratch& solids) noexcept {
    SolidBodyScratch& scratch = solids.bodies[body];
    const Thing id = Thing::body(body);
    const spheretree::SphereTree* tree = &model.bodies[body].covering.tree;
    if (is_lazy(scratch)) return {id, tree, scratch.wrapped.spheres(), &scratch.wrapped};
    return {id, tree, scratch.spheres};
}

spheretree::SolidView view_self(const SceneModel& model, std::size_t body, SolidScratch& solids) noexcept {
    spheretree::SolidView view = view_solid(model, body, solids);
    if (!solids.bodies[body].self_spheres.empty()) view.spheres = solids.bodies[body].self_spheres;
    return view;
}

const spheretree::Sphere& sphere_of(std::size_t body, Index sphere, SolidScratch& solids) noexcept {
    SolidBodyScratch& scratch = solids.bodies[body];
    if (!is_lazy(scratch)) return scratch.spheres[sphere];
    scratch.wrapped.ensure(sphere, 1);
    return scratch.wrapped.spheres()[sphere];
}

const spheretree::Sphere* known_sphere(std::size_t body, Index sphere, const SolidScratch& solids) noexcept {
    const SolidBodyScratch& scratch = solids.bodies[body];
    if (!is_lazy(scratch)) return &scratch.spheres[sphere];
    return scratch.wrapped.knows(sphere) ? &scratch.wrapped.spheres()[sphere] : nullptr;
}

void keep_turns(const SceneModel& model, const State& state, SolidScratch& solids) {
    for (std::size_t i = 0; i < model.bodies.size(); ++i)
        if (model.bodies[i].wrapped && model.bodies[i].moves()) read_turns(state.bodies[i].frames, solids.bodies[i].turn_t0);
}

} // namespace trocar::engine
