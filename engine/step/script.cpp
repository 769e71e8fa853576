#include "engine/step/script.hpp"

#include <algorithm>
#include <limits>
#include <cmath>

namespace seldinger::engine {

namespace {

/// m of insertion without progress along the route before the hand pulls back.
constexpr double kPatience = 0.015;
/// m; progress below this is no progress: the tip's jitter in contact.
constexpr double kProgressStep = 0.0005;
/// m pulled back at the first attempt; each further attempt adds as much again, up to four times.
constexpr double kRetraction = 0.012;
/// rad by which every further attempt aims beside the route: a carina that was hit once is hit again otherwise.
constexpr double kAimOffset = 0.5;
/// Share of the speed that is kept while the tip is not aimed yet: at the first attempt, and after a failure.
constexpr double kBoldShare = 0.7, kCarefulShare = 0.1;
/// m beyond the free radius around the route at which the tip is in another branch.
constexpr double kOffRoute = 1e-3;
/// N at the entry: more than this a careful hand does not push; it waits, and pulls back when that lasts.
constexpr double kPushLimit = 1.0;
/// m/s of insertion that count as patience spent while the hand only waits.
constexpr double kWaitingSpeed = 0.02;
/// m; the tip searches the route this far behind and ahead of where it was last.
constexpr double kSearchBack = 0.03, kSearchAhead = 0.02;

double clamp_change(double from, double wanted, double limit) noexcept {
    return from + std::clamp(wanted - from, -limit, limit);
}

std::size_t find_point_at(const Route& route, double length) noexcept {
    const auto it = std::lower_bound(route.length.begin(), route.length.end(), length);
    return std::min<std::size_t>(static_cast<std::size_t>(it - route.length.begin()), route.points.size() - 1);
}

/// Arc length of the route's point nearest to the tip, and whether the tip is within the route's lumen there.
struct Progress {
    double length;
    bool on_route;
};

Progress find_progress(const Route& route, const Vec3& tip, double last) noexcept {
    double best_sq = std::numeric_limits<double>::infinity();
    Progress progress{last, false};
    const std::size_t end = find_point_at(route, last + kSearchAhead);
    for (std::size_t i = find_point_at(route, std::max(0.0, last - kSearchBack)); i <= end; ++i) {
        const double distance_sq = (route.points[i] - tip).squaredNorm();
        if (distance_sq >= best_sq) continue;
        best_sq = distance_sq;
        const double room = route.radii[i] + kOffRoute;
        progress = {route.length[i], distance_sq <= room * room};
    }
    return progress;
}

Vec3 unit_or(const Vec3& v, const Vec3& fallback) noexcept {
    const double length = std::sqrt(v.squaredNorm());
    return length > 1e-9 ? Vec3(v / length) : fallback;
}

/// Wanted change of the handle's angle, in [-1, 1] of what the limit allows, and how well the tip is aimed, in [0, 1].
struct Aim {
    double turn;
    double quality;
};

Aim aim_tip(const Route& route, const FollowSettings& settings, const TipView& view, const FollowState& state) noexcept {
    const Vec3 ahead = route.points[find_point_at(route, state.progress + settings.look_ahead)] - view.tip;
    const Vec3 across = ahead - ahead.dot(view.tangent) * view.tangent;
    const double lateral = std::sqrt(across.squaredNorm());
    // Straight ahead the direction across means nothing: leave the handle alone.
    const double matters = std::min(1.0, lateral / (0.25 * settings.look_ahead));
    Vec3 wanted = unit_or(across, view.bend);
    if (state.attempts > 0) { // alternate sides, one offset further every second attempt
        const double side = (state.attempts % 2 == 1) ? 1.0 : -1.0;
        const double offset = side * kAimOffset * static_cast<double>(std::min(state.attempts, 6u) + 1) / 2.0;
        wanted = unit_or(wanted + offset * view.tangent.cross(wanted), wanted);
    }
    const double sine = view.tangent.dot(view.bend.cross(wanted));
    const double cosine = view.bend.dot(wanted);
    const double error = cosine > 0.0 ? sine : (sine >= 0.0 ? 1.0 : -1.0);
    return {matters * std::clamp(3.0 * error, -1.0, 1.0), 1.0 - matters * 0.5 * (1.0 - cosine)};
}

} // namespace

DriveCommand limit_command(const DriveCommand& from, const DriveCommand& wanted, const DriveLimits& limits,
                           double dt) noexcept {
    return {clamp_change(from.insertion, wanted.insertion, limits.speed * dt),
            clamp_change(from.rotation, wanted.rotation, limits.rotation * dt)};
}

DriveCommand follow_route(const Route& route, const FollowSettings& settings, const DriveLimits& limits,
                          const TipView& view, const DriveCommand& now, double dt, FollowState& state) noexcept {
    if (route.points.empty() || state.mode == FollowMode::Arrived) return now;
    const Progress progress = find_progress(route, view.tip, state.progress);
    state.progress = progress.length;
    const double missing = std::sqrt((route.points.back() - view.tip).squaredNorm());
    if (missing <= settings.tolerance) {
        state.mode = FollowMode::Arrived;
        return now;
    }
    const bool resisted = view.resistance > kPushLimit;
    if (progress.on_route && state.progress > state.best_progress + kProgressStep) {
        state.best_progress = state.progress;
        state.best_insertion = now.insertion;
        if (state.mode == FollowMode::Advance) state.attempts = 0;
    }
    if (resisted) state.best_insertion -= kWaitingSpeed * dt;
    if (state.mode == FollowMode::Advance && now.insertion - state.best_insertion > kPatience) {
        state.mode = FollowMode::Retract;
        ++state.attempts;
        state.retract_to = now.insertion - kPatience - kRetraction * std::min(state.attempts, 4u);
    }
    const Aim aim = aim_tip(route, settings, view, state);
    DriveCommand wanted = now;
    wanted.rotation += aim.turn * limits.rotation * dt;
    if (state.mode == FollowMode::Retract) {
        wanted.insertion -= settings.speed * dt;
        if (wanted.insertion <= state.retract_to) {
            state.mode = FollowMode::Advance;
            state.best_insertion = wanted.insertion;
            state.best_progress = std::min(state.best_progress, state.progress);
        }
    } else if (!resisted) {
        // Push slowly while the tip still looks elsewhere: the fork must not pass by before the tip is turned. Where a
        // first attempt failed, more slowly.
        const double least = state.attempts > 0 ? kCarefulShare : kBoldShare;
        wanted.insertion += settings.speed * dt * std::max(least, aim.quality * aim.quality * aim.quality);
    }
    return limit_command(now, wanted, limits, dt);
}

} // namespace seldinger::engine
