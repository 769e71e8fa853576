#include "engine/step/tissue/surface_spring.hpp"
#include "engine/prepare/body_pairs.hpp"

namespace trocar::engine {

namespace {

fem::ContactSpring start_spring(const SurfacePush& push, const fem::ContactSprings& springs) {
    fem::ContactSpring spring;
    spring.first_entry = static_cast<Index>(springs.entries.size());
    spring.stiffness = push.stiffness;
    spring.damping = push.damping;
    spring.limit = push.limit;
    spring.offset = push.gap;
    spring.rate = push.rate;
    return spring;
}

/// Vertices of neighbouring triangles hang on the same nodes: each has one entry of a spring.
void add_entry(const fem::SpringEntry& entry, std::size_t first, std::vector<fem::SpringEntry>& entries) {
    for (std::size_t k = first; k < entries.size(); ++k)
        if (entries[k].node == entry.node) {
            entries[k].g += entry.g;
            return;
        }
    entries.push_back(entry); // reserved
}

} // namespace

bool add_surface_spring(const SceneModel& model, const SurfacePush& push, const State& state, BodiesScratch& bodies) {
    const std::size_t owner = owner_of(model, push.body);
    const std::vector<Vec3>& nodes = state.bodies[owner].tissue.position;
    fem::ContactSprings& springs = bodies.tissue[owner].contact;
    fem::ContactSpring spring = start_spring(push, springs);
    for (std::size_t k = 0; k < push.vertices.size(); ++k) {
        const auto spread = push.holds ? fem::spread_hold : fem::spread_link_force;
        const fem::LinkForces share = spread(*model.bodies[push.body].links, push.vertices[k], nodes, push.weights[k] * push.direction);
        for (std::size_t n = 0; n < fem::kMostLinkNodes; ++n) {
            if (share.node[n] == kNoIndex) continue;
            add_entry({share.node[n], share.force[n]}, spring.first_entry, springs.entries);
            spring.offset -= share.force[n].dot(nodes[share.node[n]]);
        }
    }
    spring.entry_count = static_cast<std::uint16_t>(springs.entries.size() - spring.first_entry);
    if (spring.entry_count == 0) return false;
    springs.springs.push_back(spring);
    return true;
}

} // namespace trocar::engine
