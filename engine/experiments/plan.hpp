// Path planning: the way through the lumen from the entry to a target, and the drive commands that take the instrument
// along it, found by simulation with feedback.
//
// This work is based on: Gayle, Segars, Lin, Manocha 2005, "Path Planning for Deformable Robots in Complex Environments"
// (a roadmap in free space guides a simulated deformable robot). Deviates: the roadmap is the graph of the lumen's inscribed
// spheres, and the guidance is drive commands at the entry, as a surgeon turns and pushes, not a force field on the body.
#pragma once

#include "engine/prepare/prepare_scene.hpp"

#include <cstdint>
#include <functional>

namespace trocar::engine {

/// The route at rest, point by point.
struct RouteReport {
    double length = 0.0;                // m
    double smallest_radius = 0.0;       // m, clearance around the route
    double smallest_radius_at = 0.0;    // m along the route
    double sharpest_curvature = 0.0;    // 1/m
    double sharpest_curvature_at = 0.0; // m along the route
    std::vector<double> curvature;      // [points] 1/m
};

/// Curvature of a polyline at each point, from the circle through it and the points `window` m before and behind.
[[nodiscard]] std::vector<double> find_curvature(const Route& route, double window);

/// Curvature over a window of the instrument's own diameter, or three route points where that is more.
[[nodiscard]] RouteReport inspect_route(const Route& route, double instrument_radius);

struct Plan {
    bool arrived = false;
    std::vector<DriveRow> path;   // drive commands, a row per step
    std::vector<double> progress; // [path] m, distance of the tip from the target
    double time = 0.0;            // s, when the tip arrived; the end of the trial if it did not
    double closest = 0.0;         // m, tip to target at its nearest
    double last = 0.0;            // m, at the end of the plan
    double furthest = 0.0;        // m along the route, that the tip came
    double place = 0.0;           // m along the route, where the last attempts were made; where it was at the end if it made none
    unsigned attempts = 0;        // there
    unsigned retractions = 0;
    std::uint64_t lumen_exits = 0;
    double largest_force = 0.0; // N on the wall
};

/// Forecast of `run --path` for a path: open loop, in the scene as it is.
struct Replay {
    std::uint64_t steps = 0;
    double seconds = 0.0;                       // simulated
    double last = 0.0, least = 0.0, most = 0.0; // m, tip to target: at the end, and over the last period of breathing or pulse
    std::uint64_t lumen_exits = 0;
};

/// Drives the first instrument along its route in the prepared scene, for at most `time_limit` s of simulated time, and a
/// little longer once it has arrived, to see it stay; where organs breathe or walls pulsate to the end of the scene, so that the drive's
/// responses to their known phase are part of the path. The scene's budget is used as it stands: without a clock in it a plan is the same
/// everywhere.
/// stopped   asked after every step with the share that is done; true ends the trial
[[nodiscard]] Plan find_motion(const SceneModel& model, double time_limit, const std::function<bool(double)>& stopped);

/// Steps that `run --path` takes with these rows to the end of the scene, or of the path where that is longer.
[[nodiscard]] std::uint64_t count_replay_steps(const SceneModel& model, std::size_t rows) noexcept;

/// Moves the first instrument by the rows alone, and measures its tip against the target that the model's route leads to.
/// stopped   as above
[[nodiscard]] Replay replay_path(const SceneModel& model, std::vector<DriveRow> rows, const std::function<bool(double)>& stopped);

} // namespace trocar::engine
