#include "engine/step/instrument/script.hpp"

#include "base/trig.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace trocar::engine {

namespace {

/// m, look_ahead that the lengths below, up to kForgetFork, are written for: with a shorter one, which a small vessel asks for, they are in
/// proportion to it. A longer one leaves them as they are: wide vessels do not need more.
constexpr double kUsualLookAhead = 0.012;
/// m of insertion without progress along the route before it is pulled back: the slack of a shaft in wide vessels.
constexpr double kPatience = 0.015;
/// m of insertion with the tip in another branch before it is pulled back: the fork is behind, waiting brings nothing.
constexpr double kAstrayPatience = 0.006;
/// m; progress below this is no progress: the tip's jitter in contact.
constexpr double kProgressStep = 0.0005;
/// m before the fork where an attempt begins: one that keeps the aim begins so far back that the shaft lies as it does when it comes from
/// afar. And how much further back each further round of attempts begins.
constexpr double kBeforeFork = 0.006, kFarBeforeFork = 0.018, kFurtherBack = 0.006;
/// m of insertion that one retraction may take: a shaft whose slack is longer is not stuck at the tip.
constexpr double kLongestRetraction = 0.08;
/// m beyond the fork where an attempt has succeeded: steering begins again; and where it is forgotten.
constexpr double kPastFork = 0.005, kForgetFork = 0.012;
/// An attempt at a fork. It turns the tip to an angle beside the aim, and then either keeps it there by the aim that changes on the way,
/// and pushes as fast as the limit allows, or holds the handle still.
struct Attempt {
    double offset; // rad, beside the aim
    bool keeps_aim;
};
/// A round: the angles at which the handle is held are all round. The aim is kept close to the first one, where a branch off a wide vessel
/// takes the tip within some 0.2 rad only, and only when it is pushed fast.
constexpr std::array<Attempt, kAttemptsInARound> kRound{{{0.0, false},
                                          {0.0, true},
                                          {0.2, true},
                                          {-0.2, true},
                                          {0.6, false},
                                          {-0.6, false},
                                          {1.2, false},
                                          {-1.2, false},
                                          {1.8, false},
                                          {-1.8, false},
                                          {2.4, false},
                                          {-2.4, false},
                                          {3.0, false}}};
/// Share of the tip's offset to either hand of its way that the aim leaves. In a wide vessel the shaft leans on the wall, and its tip comes
/// to a branch beside the branch's middle: there it has to point along the branch. A tip that is turned to the middle reaches less far out,
/// and slides over the branch's rim; one that only points along the route stays beside it.
constexpr double kOffsetKept = 0.5;
/// A tip is aimed when the sine of its error is below this; a turn that takes longer than kLongestTurn s is over anyway.
constexpr double kAimed = 0.15, kLongestTurn = 2.5;
/// s beyond the end of the route and beside it, while it goes back and forth there; then another attempt is made.
constexpr double kLongestBeside = 1.0;
/// Share of the tolerance within which nothing is left to improve.
constexpr double kNear = 0.3;
/// Tolerances away from the end of the route at which a tip that had arrived is brought back.
constexpr double kSlipped = 1.2;
/// Share of the speed that is kept while the tip is not aimed yet.
constexpr double kBoldShare = 0.7;
/// m beyond the route's clearance at which the tip may be in another branch.
constexpr double kOffRoute = 1e-3;
/// Clearances beside the route at which a tip that sees it is in its lumen all the same: sections are not round. Farther away it looks back at
/// the fork from another branch.
constexpr double kWidestSection = 4.0;
/// N at the entry: no command pushes against more than this; it waits, and pulls back when that lasts.
constexpr double kPushLimit = 1.0;
/// m/s of insertion that count as patience spent while it only waits.
constexpr double kWaitingSpeed = 0.02;
/// m; the tip searches the route this far behind and ahead of where it was last.
constexpr double kSearchBack = 0.03, kSearchAhead = 0.02;

double square(double x) noexcept { return x * x; }

double clamp_change(double from, double wanted, double limit) noexcept { return from + std::clamp(wanted - from, -limit, limit); }

double scale_of(const FollowSettings& settings) noexcept { return std::min(1.0, settings.look_ahead / kUsualLookAhead); }

/// Where the tip is along the route, and whether it is in the route's lumen there.
struct Progress {
    double length; // m
    bool on_route;
};

Progress find_progress(const Route& route, const TipView& view, double last) noexcept {
    const std::size_t nearest = find_nearest_point(route, view.tip, last);
    const bool near = (route.points[nearest] - view.tip).squaredNorm() <= square(kWidestSection * route.radii[nearest]);
    return {route.length[nearest], (view.sees_route && near) || is_within_clearance(route, nearest, view.tip)};
}

Vec3 unit_or(const Vec3& v, const Vec3& fallback) noexcept {
    const double length = std::sqrt(v.squaredNorm());
    return length > 1e-9 ? Vec3(v / length) : fallback;
}

/// The attempt that is made at a fork; the first is number 1.
const Attempt& attempt_now(const FollowState& state) noexcept { return kRound[(state.attempts - 1) % kRound.size()]; }

/// Wanted change of the handle's angle, in [-1, 1] of what the limit allows; how well the tip is aimed, in [0, 1].
struct Aim {
    double turn;
    double quality;
    bool aimed;
};

Vec3 part_across(const Vec3& v, const Vec3& axis) noexcept { return v - v.dot(axis) * axis; }

/// Where the tip has to go across the shaft, m: to the route ahead, less the share of its offset to either hand of that way that may stay.
Vec3 find_way_across(const Route& route, const FollowSettings& settings, const TipView& view, double progress) noexcept {
    const Vec3 way = part_across(route.points[find_point_at(route, progress + settings.look_ahead)] - view.tip, view.tangent);
    const Vec3 side = view.tangent.cross(unit_or(way, view.bend));
    return way + kOffsetKept * (view.tip - route.points[find_point_at(route, progress)]).dot(side) * side;
}

Aim aim_tip(const Route& route, const FollowSettings& settings, const TipView& view, const FollowState& state, double offset) noexcept {
    const Vec3 across = find_way_across(route, settings, view, state.progress);
    const double lateral = std::sqrt(across.squaredNorm());
    // Straight ahead the direction across means nothing: leave the handle alone.
    const double matters = std::min(1.0, lateral / (0.25 * settings.look_ahead));
    const Vec3 toward = unit_or(across, view.bend);
    const SinCos turned = sin_cos(offset);
    const Vec3 wanted = turned.cos * toward + turned.sin * view.tangent.cross(toward);
    const double sine = view.tangent.dot(view.bend.cross(wanted));
    const double cosine = view.bend.dot(wanted);
    const double error = cosine > 0.0 ? sine : (sine >= 0.0 ? 1.0 : -1.0);
    return {matters * std::clamp(3.0 * error, -1.0, 1.0), 1.0 - matters * 0.5 * (1.0 - cosine), cosine > 0.0 && std::abs(sine) < kAimed};
}

/// Where the tip stands now, and what that means for patience.
void note_progress(const Progress& progress, const DriveCommand& now, FollowState& state) noexcept {
    state.progress = progress.length;
    if (!progress.on_route) return;
    state.astray_insertion = now.insertion;
    if (state.progress <= state.best_progress + kProgressStep) return;
    state.best_progress = state.progress;
    state.best_insertion = now.insertion;
}

/// Past the last point of the route, which is the nearest one; and beside it by more than the tolerance.
struct Beyond {
    bool end = false, beside = false;
};

Beyond find_beyond(const Route& route, const FollowSettings& settings, const Vec3& tip, double progress) noexcept {
    if (route.points.size() < 2 || progress < route.length.back()) return {};
    const Vec3& end = route.points.back();
    const Vec3 direction = unit_or(end - route.points[route.points.size() - 2], Vec3::Zero());
    if (!((tip - end).dot(direction) > 0.0)) return {};
    return {true, part_across(tip - end, direction).squaredNorm() > settings.tolerance * settings.tolerance};
}

bool has_failed(const DriveCommand& now, double scale, const FollowState& state) noexcept {
    return now.insertion - state.best_insertion > scale * kPatience || now.insertion - state.astray_insertion > scale * kAstrayPatience;
}

/// Another attempt at the same fork, or the first at a new one.
void begin_retraction(const DriveCommand& now, double scale, FollowState& state) noexcept {
    if (state.attempts == 0 || state.best_progress > state.fork + scale * kForgetFork) {
        state.fork = state.best_progress;
        state.attempts = 0;
    }
    ++state.attempts;
    state.mode = FollowMode::Retract;
    state.retract_from = now.insertion;
}

bool stands_before_fork(const Progress& progress, const DriveCommand& now, double scale, const FollowState& state) noexcept {
    const double before = state.fork - scale * (attempt_now(state).keeps_aim ? kFarBeforeFork : kBeforeFork) -
                          scale * kFurtherBack * static_cast<double>((state.attempts - 1) / kRound.size());
    return (progress.on_route && state.progress <= std::max(0.0, before)) || state.retract_from - now.insertion > kLongestRetraction ||
           now.insertion <= 0.0;
}

void begin_push(FollowMode mode, const DriveCommand& now, FollowState& state) noexcept {
    state.mode = mode;
    state.best_progress = std::min(state.best_progress, state.progress);
    state.best_insertion = state.astray_insertion = now.insertion;
    state.turned_for = 0.0;
}

} // namespace

std::size_t find_point_at(const Route& route, double length) noexcept {
    const auto it = std::lower_bound(route.length.begin(), route.length.end(), length);
    return std::min<std::size_t>(static_cast<std::size_t>(it - route.length.begin()), route.points.size() - 1);
}

std::size_t find_nearest_point(const Route& route, const Vec3& tip, double last) noexcept {
    double best_sq = std::numeric_limits<double>::infinity();
    const std::size_t begin = find_point_at(route, std::max(0.0, last - kSearchBack)), end = find_point_at(route, last + kSearchAhead);
    std::size_t best = begin;
    for (std::size_t i = begin; i <= end; ++i) {
        const double distance_sq = (route.points[i] - tip).squaredNorm();
        if (distance_sq >= best_sq) continue;
        best_sq = distance_sq;
        best = i;
    }
    return best;
}

bool is_within_clearance(const Route& route, std::size_t point, const Vec3& tip) noexcept {
    const double clearance = route.radii[point] + kOffRoute;
    return (route.points[point] - tip).squaredNorm() <= clearance * clearance;
}

DriveCommand limit_command(const DriveCommand& from, const DriveCommand& wanted, const DriveLimits& limits, double dt) noexcept {
    return {clamp_change(from.insertion, wanted.insertion, limits.speed * dt),
            clamp_change(from.rotation, wanted.rotation, limits.rotation * dt)};
}

DriveCommand follow_route(const Route& route, const FollowSettings& settings, const DriveLimits& limits, const TipView& view,
                          const DriveCommand& now, double dt, FollowState& state) noexcept {
    if (route.points.empty()) return now;
    const Progress progress = find_progress(route, view, state.progress);
    note_progress(progress, now, state);
    const double missing = std::sqrt((route.points.back() - view.tip).squaredNorm());
    // Within the tolerance it goes on for as long as that brings the tip nearer: the organ's breath moves it about that place.
    if (missing <= settings.tolerance && (missing <= kNear * settings.tolerance || missing >= state.missing))
        state.mode = FollowMode::Arrived;
    state.missing = missing;
    if (state.mode == FollowMode::Arrived) {
        if (missing <= kSlipped * settings.tolerance) return now;
        begin_push(FollowMode::Advance, now, state); // the organ moved on, or the shaft's slack
    }
    const bool pushes = state.mode == FollowMode::Advance || state.mode == FollowMode::Probe;
    const bool resisted = view.resistance > kPushLimit;
    if (pushes && resisted) state.best_insertion -= kWaitingSpeed * dt;
    const Beyond beyond = find_beyond(route, settings, view.tip, state.progress);
    if (state.mode == FollowMode::Advance && beyond.beside) state.turned_for += dt;
    const bool missed = beyond.beside && (state.mode == FollowMode::Probe || state.turned_for > kLongestBeside);
    const double scale = scale_of(settings);
    if (pushes && (missed || has_failed(now, scale, state))) begin_retraction(now, scale, state);

    DriveCommand wanted = now;
    const auto turn_to = [&](const Aim& aim) { wanted.rotation += aim.turn * limits.rotation * dt; };
    switch (state.mode) {
    case FollowMode::Advance: {
        const Aim aim = aim_tip(route, settings, view, state, 0.0);
        turn_to(aim);
        // Push slowly while the tip still looks elsewhere: the fork must not pass by before the tip is turned.
        const double share = std::max(kBoldShare, aim.quality * aim.quality * aim.quality);
        if (beyond.end)
            wanted.insertion -= settings.speed * dt * share;
        else if (!resisted)
            wanted.insertion += settings.speed * dt * share;
        break;
    }
    case FollowMode::Retract:
        wanted.insertion -= settings.speed * dt;
        if (stands_before_fork(progress, now, scale, state)) {
            state.mode = FollowMode::Turn;
            state.turned_for = 0.0;
        }
        break;
    case FollowMode::Turn: {
        const Aim aim = aim_tip(route, settings, view, state, attempt_now(state).offset);
        turn_to(aim);
        state.turned_for += dt;
        if (aim.aimed || state.turned_for > kLongestTurn) begin_push(FollowMode::Probe, now, state);
        break;
    }
    case FollowMode::Probe:
        if (attempt_now(state).keeps_aim) turn_to(aim_tip(route, settings, view, state, attempt_now(state).offset));
        if (!resisted) wanted.insertion += (attempt_now(state).keeps_aim ? std::max(settings.speed, scale * limits.speed) : settings.speed) * dt;
        if (progress.on_route && state.progress > state.fork + scale * kPastFork) begin_push(FollowMode::Advance, now, state);
        break;
    case FollowMode::Arrived:
        break;
    }
    return limit_command(now, wanted, limits, dt);
}

} // namespace trocar::engine
