// The run that all others are measured against: what is kept of it.
#pragma once

#include "engine/experiments/cost_table.hpp"

namespace trocar::engine {

/// The compared part of a state: surfaces of bodies that move, skins of instruments.
struct Shape {
    std::vector<std::vector<Vec3>> surfaces, skins;
};

struct ExactRun {
    std::uint64_t every = 1;             // steps between kept states
    std::uint64_t steps = 0;             // taken
    std::vector<Shape> shapes;           // after every such step
    std::vector<std::vector<Vec3>> tips; // [step][instrument] m
    std::uint64_t busiest_step = 0;      // in which most pairs of spheres were tested, from 1; 0: no step
    std::string failure;
};

/// Where the compared stretch begins: options.from steps without any limit. A run that fails on the way gives the last good state.
[[nodiscard]] State run_to_start(const SceneModel& model, const CostOptions& options);

/// The simulator goes on from options.start. False: that is no state of its model, and it has not moved.
/// scene   whose state options.start is; the simulator's model, or what that is a variant of
[[nodiscard]] bool go_to_start(Simulator& simulator, const CostOptions& options, const SceneModel& scene);
inline constexpr const char* kForeignStart = "the state at which the compared stretch begins is not of this model";

/// The simulator, of the scene or of a variant of it, goes on from a state of the scene: without what names leaves of other trees, and
/// without the contacts of surfaces where spheres push.
/// fails   as Simulator::restore
[[nodiscard]] Result<void> restore_variant(Simulator& simulator, const State& state, const SceneModel& scene);

/// Without any limit, as the scene says.
[[nodiscard]] ExactRun run_exactly(const SceneModel& model, const CostOptions& options);

[[nodiscard]] Shape shape_of(const SceneModel& model, const State& state);

/// Surfaces and skins of a state against those of the exact run.
[[nodiscard]] SurfaceDistance compare_shapes(const SceneModel& model, const Shape& shape, const Shape& exact);

/// m; farthest tip of any instrument from where it is in the exact run. 0 without instruments.
[[nodiscard]] double tip_distance(const State& state, const std::vector<Vec3>& exact);

} // namespace trocar::engine
