#include "engine/step/tissue/surface_spring.hpp"
#include "engine/prepare/body_pairs.hpp"

namespace trocar::engine {

namespace {

/// [-]; of a unit force, what two places that hang on nodes with all their weight leave over is rounding.
constexpr double kBalanced = 1e-12;

fem::ContactSpring start_spring(const SurfacePush& push, const fem::ContactSprings& springs) {
    fem::ContactSpring spring;
    spring.first_entry = static_cast<Index>(springs.entries.size());
    spring.stiffness = push.stiffness;
    spring.damping = push.damping;
    spring.limit = push.limit;
    spring.offset = push.gap;
    spring.rate = push.rate;
    spring.load = push.load;
    spring.friction = push.friction;
    return spring;
}

/// Of one place; returns the sum of what its nodes get of a unit force.
Vec3 add_entries(const SceneModel& model, const SurfacePush& push, const std::vector<Vec3>& nodes, fem::ContactSprings& springs,
                 fem::ContactSpring& spring) {
    Vec3 sum = Vec3::Zero();
    for (std::size_t k = 0; k < push.vertices.size(); ++k) {
        const fem::LinkForces share =
            fem::spread_link_force(*model.bodies[push.body].links, push.vertices[k], nodes, push.weights[k] * push.direction);
        for (int n = 0; n < 3; ++n) {
            if (share.node[n] == kNoIndex) continue;
            springs.entries.push_back({share.node[n], share.force[n]});
            spring.offset -= share.force[n].dot(nodes[share.node[n]]);
            sum += share.force[n];
        }
    }
    return sum;
}

bool finish_spring(fem::ContactSpring& spring, fem::ContactSprings& springs) {
    spring.entry_count = static_cast<std::uint16_t>(springs.entries.size() - spring.first_entry);
    if (spring.entry_count == 0) return false;
    springs.springs.push_back(spring);
    return true;
}

} // namespace

bool add_surface_spring(const SceneModel& model, const SurfacePush& push, State& state) {
    const std::size_t owner = owner_of(model, push.body);
    fem::ContactSprings& springs = state.bodies[owner].springs;
    fem::ContactSpring spring = start_spring(push, springs);
    add_entries(model, push, state.bodies[owner].tissue.position, springs, spring);
    return finish_spring(spring, springs);
}

bool add_balanced_spring(const SceneModel& model, const SurfacePush& a, const SurfacePush& b, State& state) {
    const std::size_t owner = owner_of(model, a.body);
    const std::vector<Vec3>& nodes = state.bodies[owner].tissue.position;
    fem::ContactSprings& springs = state.bodies[owner].springs;
    fem::ContactSpring spring = start_spring(a, springs);
    SurfacePush against = b;
    against.direction = -a.direction;
    const Vec3 left = add_entries(model, a, nodes, springs, spring) + add_entries(model, against, nodes, springs, spring);
    spring.balanced = left.squaredNorm() < kBalanced * kBalanced; // else a part of the surface stands still and takes the rest
    return finish_spring(spring, springs);
}

} // namespace trocar::engine
