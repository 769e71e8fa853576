// What the hands do: insertion and rotation of an instrument over time, from a table or steered towards a target.
#pragma once

#include "base/vec.hpp"

#include <span>
#include <vector>

namespace seldinger::engine {

/// One row of a path: linear between rows, held before the first and after the last.
struct DriveRow {
    double time = 0.0;      // s, ascending
    double insertion = 0.0; // m
    double rotation = 0.0;  // rad
};

struct DriveLimits {
    double speed = 0.035;   // m/s, of insertion and retraction
    double rotation = 3.14; // rad/s
};

struct DriveCommand {
    double insertion = 0.0; // m
    double rotation = 0.0;  // rad
};

/// Wanted position of the handle at `time`. rows must not be empty.
[[nodiscard]] DriveCommand evaluate_path(std::span<const DriveRow> rows, double time) noexcept;

/// The command nearest to `wanted` that the limits allow within `dt` seconds from `from`.
[[nodiscard]] DriveCommand limit_command(const DriveCommand& from, const DriveCommand& wanted, const DriveLimits& limits,
                                         double dt) noexcept;

/// The lumen's middle from the port to the target.
struct Route {
    std::vector<Vec3> points;   // [n] m
    std::vector<double> radii;  // [n] m
    std::vector<double> length; // [n] m, arc length from the first point
};
[[nodiscard]] Route make_route(std::vector<Vec3> points, std::vector<double> radii);

struct FollowSettings {
    double speed = 0.025;      // m/s, where the way is straight
    double look_ahead = 0.012; // m, of the route beyond the tip that the tip is turned to
    double tolerance = 0.003;  // m, to the end of the route: arrived
};

enum class FollowMode : std::uint8_t { Advance, Retract, Arrived };

/// The hand's memory. Plain data: part of the state, so that a run can be repeated bit for bit.
struct FollowState {
    FollowMode mode = FollowMode::Advance;
    double progress = 0.0;          // m along the route of the point nearest to the tip
    double best_progress = 0.0;     // m
    double best_insertion = 0.0;    // m, when best_progress last grew
    double retract_to = 0.0;        // m
    unsigned attempts = 0;          // retractions so far
};

/// What the hand sees, as on the fluoroscopy screen.
struct TipView {
    Vec3 tip = Vec3::Zero();        // m
    Vec3 tangent = Vec3::UnitZ();   // unit, of the shaft where the shaped tip begins
    Vec3 bend = Vec3::UnitX();      // unit, across the tangent: where the shaped tip points
};

/// Turns the handle until the shaped tip points to the route ahead, pushes when it does, and pulls back and tries at
/// another angle when insertion no longer brings the tip forward (a wrong branch, a loop).
/// source   the surgeon's own rule; no planner. deviation: sees the true position of the tip.
[[nodiscard]] DriveCommand follow_route(const Route& route, const FollowSettings& settings, const DriveLimits& limits,
                                        const TipView& view, const DriveCommand& now, double dt,
                                        FollowState& state) noexcept;

} // namespace seldinger::engine
