#include "engine/step/surface_spring.hpp"

namespace seldinger::engine {

std::size_t owner_of(const SceneModel& model, std::size_t body) noexcept {
    return model.bodies[body].carrier != SIZE_MAX ? model.bodies[body].carrier : body;
}

bool add_surface_spring(const SceneModel& model, const SurfacePush& push, const State& state, StepContext& context) {
    const std::size_t owner = owner_of(model, push.body);
    const std::vector<Vec3>& nodes = state.bodies[owner].tissue.position;
    fem::ContactSprings& springs = context.bodies[owner].springs;
    fem::ContactSpring spring;
    spring.first_entry = static_cast<Index>(springs.entries.size());
    spring.stiffness = push.stiffness;
    spring.damping = push.damping;
    spring.limit = push.limit;
    spring.offset = push.gap;
    spring.rate = push.rate;
    spring.load = push.load;
    spring.friction = push.friction;
    for (std::size_t k = 0; k < push.vertices.size(); ++k) {
        const fem::LinkForces share =
            fem::spread_link_force(*model.bodies[push.body].links, push.vertices[k], nodes, push.weights[k] * push.direction);
        for (int n = 0; n < 3; ++n) {
            if (share.node[n] == kNoIndex) continue;
            springs.entries.push_back({share.node[n], share.force[n]});
            spring.offset -= share.force[n].dot(nodes[share.node[n]]);
        }
    }
    spring.entry_count = static_cast<std::uint16_t>(springs.entries.size() - spring.first_entry);
    if (spring.entry_count == 0) return false;
    springs.springs.push_back(spring);
    return true;
}

} // namespace seldinger::engine
