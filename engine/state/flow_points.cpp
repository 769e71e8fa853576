#include "engine/state/flow_points.hpp"

#include "engine/prepare/scripted_motion.hpp"

namespace trocar::engine {

namespace {

std::span<const Vec3> place_points(const SceneModel& model, std::size_t body, double time, const State& state, fem::LinkFrames& frames,
                                   std::vector<Vec3>& moved_points) {
    const BodyModel& vessel = model.bodies[body];
    const BloodFlow& flow = *vessel.blood;
    if (flow.links) {
        moved_points.resize(flow.point_count());
        fem::update_embedded_surface(*flow.links, state.bodies[*vessel.host_body].tissue.position, flow.points, frames, moved_points);
        return moved_points;
    }
    if (vessel.path.empty()) return flow.points;
    const Vec3 moved = evaluate_motion(vessel.path, time);
    moved_points.resize(flow.point_count());
    for (std::size_t i = 0; i < flow.point_count(); ++i) moved_points[i] = flow.points[i] + moved;
    return moved_points;
}

} // namespace

std::span<const Vec3> find_flow_points(const SceneModel& model, std::size_t body, double time, State& state, std::vector<Vec3>& moved_points) {
    return place_points(model, body, time, state, state.bodies[body].flow_frames, moved_points);
}

std::span<const Vec3> find_flow_points(const SceneModel& model, std::size_t body, const State& state, fem::LinkFrames& frames,
                                       std::vector<Vec3>& moved_points) {
    frames = state.bodies[body].flow_frames;
    return place_points(model, body, state.time, state, frames, moved_points);
}

} // namespace trocar::engine
