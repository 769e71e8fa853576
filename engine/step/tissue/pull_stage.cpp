#include "engine/step/tissue/pull_stage.hpp"

#include "engine/step/tissue/surface_spring.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::engine {

namespace {

/// m; nearer to its target than this, a point is there.
constexpr double kArrived = 1e-6;

} // namespace

bool can_be_pulled(const SceneModel& model, std::size_t body) noexcept {
    return model.effects.elasticity && model.bodies[body].links.has_value();
}

void add_pull(const SceneModel& model, const Pull& pull, const State& state, BodiesScratch& bodies, StepReport& report) {
    if (!can_be_pulled(model, pull.body)) return;
    const Vec3 way = pull.target - state.bodies[pull.body].surface[pull.vertex];
    const double distance = std::sqrt(way.squaredNorm());
    if (!(distance > kArrived)) return;
    // Its gap is what the point still has to go, negative; it closes as the nodes carry the point along.
    const double reach = std::min(distance, kMaxPull / kPullStiffness);
    const Index vertices[] = {pull.vertex};
    const double weights[] = {1.0};
    SurfacePush push{pull.body, vertices, weights, way / distance, -reach, kPullStiffness};
    push.holds = true;
    if (!add_surface_spring(model, push, state, bodies))
        return; // a point of a vessel far from the organ
    report.pull_force_n = kPullStiffness * reach;
}

} // namespace trocar::engine
