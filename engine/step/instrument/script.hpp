// Drive commands: insertion and rotation of an instrument over time, from a table or steered towards a target.
#pragma once

#include "engine/state/state.hpp"

namespace trocar::engine {

/// At one place, before the next round begins further back.
inline constexpr unsigned kAttemptsInARound = 13;

/// The command nearest to `wanted` that the limits allow within `dt` seconds from `from`.
[[nodiscard]] DriveCommand limit_command(const DriveCommand& from, const DriveCommand& wanted, const DriveLimits& limits,
                                         double dt) noexcept;

/// What the rule below reads, as on the fluoroscopy screen.
struct TipView {
    Vec3 tip = Vec3::Zero();      // m
    Vec3 tangent = Vec3::UnitZ(); // unit, of the shaft where the shaped tip begins
    Vec3 bend = Vec3::UnitX();    // unit, across the tangent: where the shaped tip points
    double resistance = 0.0;      // N, compression of the rod at the entry: the resistance at the handle
    bool sees_route = false;      // no wall lies between the tip and the route's point nearest to it
};

/// Index of the route's first point at this length along it, m, or beyond; the last one where none is. The route must have points.
[[nodiscard]] std::size_t find_point_at(const Route& route, double length) noexcept;

/// Index of the route's point nearest to the tip, searched a little behind and ahead of `last`, m along the route. The route must have
/// points.
[[nodiscard]] std::size_t find_nearest_point(const Route& route, const Vec3& tip, double last) noexcept;

/// Does the inscribed sphere of that point hold the tip? Where it does not the tip may be in another branch, or across a lumen that is
/// wider than its sphere: TipView::sees_route tells.
[[nodiscard]] bool is_within_clearance(const Route& route, std::size_t point, const Vec3& tip) noexcept;

/// Turns the handle until the shaped tip points to the route ahead, and pushes when it does. When the tip enters another
/// branch, or insertion no longer brings it forward, it pulls back to before that place, and probes it at another angle each
/// time, beside the first to either hand, until one leads on: with the handle held, or, pushed as fast as the limit allows, with
/// the aim kept. Progress counts along the route, however far beside it the tip is within the lumen.
/// source   the surgeon's own rule; no planner. deviation: sees the true position of the tip.
[[nodiscard]] DriveCommand follow_route(const Route& route, const FollowSettings& settings, const DriveLimits& limits, const TipView& view,
                                        const DriveCommand& now, double dt, FollowState& state) noexcept;

} // namespace trocar::engine
