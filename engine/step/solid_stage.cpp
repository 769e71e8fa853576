#include "engine/step/solid_stage.hpp"

#include "engine/step/surface_spring.hpp"

#include <algorithm>
#include <cmath>

namespace seldinger::engine {

namespace {

spheretree::SolidView view_of(const SceneModel& model, std::size_t body, const StepContext& context) {
    return {static_cast<BodyId>(body), &model.bodies[body].covering.tree, context.bodies[body].spheres};
}

/// The triangle beneath a sphere whose middle is nearest to the contact.
Index nearest_triangle(const BodyModel& body, Index sphere, const std::vector<Vec3>& surface, const Vec3& point) {
    Index nearest = kNoIndex;
    double best = std::numeric_limits<double>::infinity();
    for (const Index triangle : body.covering.tree.items_of(sphere)) {
        const Triangle& t = body.surface.triangles[triangle];
        const double distance_sq = ((surface[t[0]] + surface[t[1]] + surface[t[2]]) / 3.0 - point).squaredNorm();
        if (distance_sq < best) {
            best = distance_sq;
            nearest = triangle;
        }
    }
    return nearest;
}

double usable_gap(const SceneModel& model, const Contact& contact) {
    if (contact.origin != ContactOrigin::AssumedSpheres) return contact.gap;
    return std::max(contact.gap, -model.contact.assumed_depth); // an untested pair must not throw the body away
}

/// Contacts of one body, as seen from its side.
void push_body(const SceneModel& model, std::size_t body, const State& state, StepContext& context) {
    const BodyModel& own = model.bodies[body];
    if (!own.tissue) return;
    std::vector<Index>& deepest = context.bodies[body].deepest; // by sphere: index of its deepest contact
    deepest.assign(own.covering.tree.sphere_count(), kNoIndex);
    for (Index k = 0; k < context.coarse.size(); ++k) {
        const Contact& contact = context.coarse[k];
        for (const bool is_a : {true, false}) {
            if ((is_a ? contact.body_a : contact.body_b) != body) continue;
            const Index sphere = is_a ? contact.feature_a[0] : contact.feature_b[0];
            Index& best = deepest[sphere];
            if (best == kNoIndex || contact.gap < context.coarse[best].gap) best = k;
        }
    }
    for (Index sphere = 0; sphere < deepest.size(); ++sphere) {
        if (deepest[sphere] == kNoIndex) continue;
        const Contact& contact = context.coarse[deepest[sphere]];
        const Vec3 normal = contact.body_a == body ? contact.normal : Vec3(-contact.normal);
        const Index triangle = nearest_triangle(own, sphere, state.bodies[body].surface, contact.point);
        constexpr std::array kMiddle{1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0};
        if (triangle != kNoIndex)
            add_surface_spring(model,
                               {body, own.surface.triangles[triangle], kMiddle, normal, usable_gap(model, contact),
                                model.contact.solid_stiffness},
                               state, context);
    }
}

} // namespace

bool are_solid_pair(const SceneModel& model, std::size_t i, std::size_t j) noexcept {
    const BodyModel& a = model.bodies[i];
    const BodyModel& b = model.bodies[j];
    if (a.hollow || b.hollow || (!a.moves() && !b.moves())) return false;
    return a.carrier != j && b.carrier != i;
}

void update_solid_trees(const SceneModel& model, const State& state, StepContext& context) {
    for (std::size_t i = 0; i < model.bodies.size(); ++i) {
        const BodyModel& body = model.bodies[i];
        if (body.hollow) continue;
        BodyScratch& scratch = context.bodies[i];
        if (body.moves() || scratch.spheres.empty())
            spheretree::update_covering_spheres(body.covering,
                                                body.moves() ? scratch.surface_t0 : state.bodies[i].surface,
                                                state.bodies[i].surface, scratch.spheres);
    }
}

void add_solid_pairs(const SceneModel& model, StepContext& context) {
    for (std::size_t i = 0; i < model.bodies.size(); ++i)
        for (std::size_t j = i + 1; j < model.bodies.size(); ++j)
            if (are_solid_pair(model, i, j))
                context.descent.add_solid_pair(view_of(model, i, context), view_of(model, j, context));
}

void push_solids(const SceneModel& model, const State& state, StepContext& context) {
    for (std::size_t body = 0; body < model.bodies.size(); ++body) push_body(model, body, state, context);
}

} // namespace seldinger::engine
