// Where the centreline on which a vessel's blood flows stands.
#pragma once

#include "engine/state/state.hpp"

#include <span>
#include <vector>

namespace trocar::engine {

/// Where the points of a body's flow stand at that time; in moved_points unless they never move.
[[nodiscard]] std::span<const Vec3> find_flow_points(const SceneModel& model, std::size_t body, double time, State& state,
                                                     std::vector<Vec3>& moved_points);

/// The same of a state that is not changed.
/// frames    worthless afterwards
[[nodiscard]] std::span<const Vec3> find_flow_points(const SceneModel& model, std::size_t body, const State& state, fem::LinkFrames& frames,
                                                     std::vector<Vec3>& moved_points);

} // namespace trocar::engine
