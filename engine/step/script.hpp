// What the hands do: insertion and rotation of an instrument over time, from a table or steered towards a target.
#pragma once

#include "engine/prepare/drive.hpp"

namespace seldinger::engine {

/// The command nearest to `wanted` that the limits allow within `dt` seconds from `from`.
[[nodiscard]] DriveCommand limit_command(const DriveCommand& from, const DriveCommand& wanted, const DriveLimits& limits,
                                         double dt) noexcept;

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
    double resistance = 0.0;        // N, compression of the rod at the entry: what the hand feels
};

/// Turns the handle until the shaped tip points to the route ahead, pushes when it does, and pulls back and tries at
/// another angle when insertion no longer brings the tip forward (a wrong branch, a loop) or meets resistance.
/// source   the surgeon's own rule; no planner. deviation: sees the true position of the tip.
[[nodiscard]] DriveCommand follow_route(const Route& route, const FollowSettings& settings, const DriveLimits& limits,
                                        const TipView& view, const DriveCommand& now, double dt,
                                        FollowState& state) noexcept;

} // namespace seldinger::engine
