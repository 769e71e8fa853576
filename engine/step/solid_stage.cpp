#include "engine/step/solid_stage.hpp"

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

/// One spring that pushes the triangle along `normal` when it is deeper than at gap 0.
void add_spring(const SceneModel& model, std::size_t body, Index triangle, const Vec3& normal, double gap,
                const State& state, fem::ContactSprings& springs) {
    const BodyModel& own = model.bodies[body];
    const std::size_t owner = own.carrier != SIZE_MAX ? own.carrier : body;
    const std::vector<Vec3>& nodes = state.bodies[owner].tissue.position;
    fem::ContactSpring spring;
    spring.first_entry = static_cast<Index>(springs.entries.size());
    spring.stiffness = model.contact.solid_stiffness;
    spring.offset = gap;
    for (const Index vertex : own.surface.triangles[triangle]) {
        const fem::LinkForces pull = fem::spread_link_force(*own.links, vertex, nodes, normal / 3.0);
        for (int n = 0; n < 3; ++n) {
            if (pull.node[n] == kNoIndex) continue;
            springs.entries.push_back({pull.node[n], pull.force[n]});
            spring.offset -= pull.force[n].dot(nodes[pull.node[n]]);
        }
    }
    spring.entry_count = static_cast<std::uint16_t>(springs.entries.size() - spring.first_entry);
    if (spring.entry_count > 0) springs.springs.push_back(spring);
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
        if (triangle != kNoIndex)
            add_spring(model, body, triangle, normal, usable_gap(model, contact), state, context.bodies[body].springs);
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
            spheretree::update_covering_spheres(body.covering, body.moves() ? scratch.surface_t0 : state.bodies[i].surface,
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
