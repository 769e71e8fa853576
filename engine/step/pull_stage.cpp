#include "engine/step/pull_stage.hpp"

#include <algorithm>
#include <cmath>

namespace seldinger::engine {

namespace {

/// m; nearer to its target than this, a point is there.
constexpr double kArrived = 1e-6;

} // namespace

bool can_be_pulled(const SceneModel& model, std::size_t body) noexcept {
    return model.effects.elasticity && model.bodies[body].links.has_value();
}

void add_pull(const SceneModel& model, const State& state, StepContext& context) {
    if (!context.pull || !can_be_pulled(model, context.pull->body)) return;
    const Pull& pull = *context.pull;
    const BodyModel& body = model.bodies[pull.body];
    const std::size_t owner = body.carrier != SIZE_MAX ? body.carrier : pull.body;
    const std::vector<Vec3>& nodes = state.bodies[owner].tissue.position;
    const Vec3 way = pull.target - state.bodies[pull.body].surface[pull.vertex];
    const double distance = std::sqrt(way.squaredNorm());
    if (!(distance > kArrived)) return;
    const fem::LinkForces forces = fem::spread_link_force(*body.links, pull.vertex, nodes, way / distance);
    fem::ContactSprings& springs = context.bodies[owner].springs;
    fem::ContactSpring spring;
    spring.first_entry = static_cast<Index>(springs.entries.size());
    spring.stiffness = kPullStiffness;
    // Its gap is what the point still has to go, negative; it closes as the nodes carry the point along.
    spring.offset = -std::min(distance, kMaxPull / kPullStiffness);
    for (int n = 0; n < 3; ++n) {
        if (forces.node[n] == kNoIndex) continue;
        springs.entries.push_back({forces.node[n], forces.force[n]});
        spring.offset -= forces.force[n].dot(nodes[forces.node[n]]);
    }
    spring.entry_count = static_cast<std::uint16_t>(springs.entries.size() - spring.first_entry);
    if (spring.entry_count == 0) return; // a point of a vessel far from the organ
    springs.springs.push_back(spring);
    context.report.pull_force_n = kPullStiffness * std::min(distance, kMaxPull / kPullStiffness);
}

} // namespace seldinger::engine
