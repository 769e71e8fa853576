#include "collision/ccd/sweep.hpp"

#include "collision/ccd/sweep_parts.hpp"

#include <optional>

namespace trocar::collision {
namespace {

/// Where no progress is possible, features this close, in units of their largest difference, are said to touch rather than to be
/// unresolved. The proof sees gaps of 16 u sqrt(3) (separation.hpp); nearest points of ill-shaped features lose more.
constexpr double kRoundingTolerance = 1024.0 * kUnitRoundoff;

/// An advance below this is no progress: 2^-50 of a step, a few roundings of the time itself.
constexpr double kSmallestAdvance = 0x1p-50;

enum class Stop : std::uint8_t { End, Near, Stuck }; // the step's end, within distance + tolerance, steps or digits ran out

/// State of the advance: everything before `time` is proven, and the end too where it got there.
struct Advance {
    double time;
    Stop stop;
    Nearest nearest;
};

/// How far the step is free from t on: along the flat normal to either side, or the robust shortest vector. For where the fast
/// shortest vector has lost its digits.
template <int Count>
double find_end_robustly(const Differences<Count>& q, double t, double distance) noexcept {
    const auto corner = at(q, t);
    const Vec3 flat = flat_normal(corner);
    double end = t;
    for (const Vec3& n : {flat, Vec3(-flat), find_nearest_robustly(corner).offset}) {
        const FreeTime free = find_free_time(q, n, distance);
        if (free.holds(t)) end = std::max(end, free.to);
    }
    return end;
}

/// With one direction per advance, features that turn while they meet come closer by a constant factor only, be it 0.9. From this
/// many advances on the direction turns as well, which makes it 0.1 or less.
constexpr int kPlainSteps = 6, kPlainStepsToTouch = 1;

/// Unit direction to separate along. Rounding tilts a shortest vector by u M / distance; below this share of M the flat normal
/// is the better one, where the two agree.
constexpr double kShort = 1e-5;
template <int Count>
Vec3 find_direction(const Differences<Count>& q, double t, const Nearest& nearest) noexcept {
    const Vec3 shortest = nearest.offset / nearest.distance;
    if (nearest.distance > kShort * q.magnitude) return shortest;
    const Vec3 flat = flat_normal(at(q, t));
    const double length = flat.norm();
    const double agreement = flat.dot(shortest);
    if (!(std::abs(agreement) > 0.99 * length)) return shortest;
    return agreement > 0.0 ? Vec3(flat / length) : Vec3(-flat / length);
}

/// The farthest of a few guesses up to which a turning direction proves freedom; `time` if none does.
/// goal   where to try first, <= 1
template <int Count>
double find_end_turning(const Differences<Count>& q, double time, const Nearest& nearest, double goal, double distance) noexcept {
    const Vec3 from = find_direction(q, time, nearest);
    for (const double share : {1.0, 0.9, 0.25}) {
        const double end = time + share * (goal - time);
        const Nearest there = find_nearest(at(q, end));
        const Turn turn{time, end, from, find_direction(q, end, there)};
        if (is_free_turning(q, turn, distance)) return end;
    }
    return time;
}

/// First time to try at distance 0: just before the features lie in one plane, as Newton's method
/// finds it from here: a guess, on which no proof depends. A 2^24th of the gap is kept, or what the proof needs.
constexpr double kKeptOfGap = 0x1p-24, kProofNeeds = 512.0 * kUnitRoundoff;
template <int Count>
std::optional<double> guess_end_before_touch(const Differences<Count>& q, double time, const Nearest& nearest) noexcept {
    double touch = time;
    for (int round = 0; round < 4; ++round) {
        const Plane plane = plane_at(q, touch);
        touch -= plane.value / plane.slope;
        if (!(touch > time && touch <= 1.0)) return std::nullopt;
    }
    return touch - (touch - time) * std::max(kKeptOfGap, std::min(0.5, kProofNeeds * q.magnitude / nearest.distance));
}

/// Advances from `time`, where `nearest` was found, while the features stay farther apart than distance; stops within
/// distance + tolerance, or at 1.
template <int Count>
Advance advance(const Differences<Count>& q, double time, Nearest nearest, double distance, double tolerance, int max_steps) noexcept {
    const double rounding = kRoundingTolerance * q.magnitude;
    const bool touches = distance + tolerance == 0.0;
    double last_time = time, last_distance = nearest.distance;
    for (int step = 0; step < max_steps; ++step) {
        if (nearest.distance <= distance + tolerance) return {time, Stop::Near, nearest};
        const FreeTime free = find_free_time(q, nearest.offset, distance);
        double end = free.holds(time) ? free.to : time;
        if (step >= (touches ? kPlainStepsToTouch : kPlainSteps) && end < 1.0) {
            const double approach = (last_distance - nearest.distance) / (time - last_time);
            double goal = approach > 0.0 ? std::min(1.0, time + 0.99 * (nearest.distance - distance) / approach) : 1.0;
            if (touches) goal = guess_end_before_touch(q, time, nearest).value_or(goal);
            end = std::max(end, find_end_turning(q, time, nearest, goal, distance));
        }
        if (end >= 1.0) return {1.0, Stop::End, nearest};
        if (end <= time + kSmallestAdvance || (touches && nearest.distance <= rounding)) {
            nearest = find_nearest_robustly(at(q, time));
            if (nearest.distance <= distance + tolerance + rounding) return {time, Stop::Near, nearest};
            end = std::max(end, find_end_robustly(q, time, distance));
            if (end >= 1.0) return {1.0, Stop::End, nearest};
            if (!(end > time + kSmallestAdvance)) return {std::max(time, end), Stop::Stuck, nearest};
        }
        last_time = time;
        last_distance = nearest.distance;
        time = end;
        nearest = find_nearest(at(q, time));
    }
    return {time, Stop::Stuck, nearest};
}

template <int Count>
double find_safe_time(const Differences<Count>& q, const Advance& contact, const SweepLimits& limits) noexcept {
    const double kept = kKeptGap * std::min(contact.nearest.distance, limits.distance);
    if (!(kept > 0.0)) return contact.time;
    return advance(q, contact.time, contact.nearest, kept, 0.5 * kept, limits.max_steps).time;
}

template <int Count>
Sweep finish(const Differences<Count>& q, const Advance& contact, const SweepLimits& limits) noexcept {
    Sweep sweep;
    if (contact.stop == Stop::End) return sweep;
    sweep.outcome = contact.stop == Stop::Stuck ? SweepOutcome::Unresolved
                    : contact.time > 0.0        ? SweepOutcome::Hit
                                                : SweepOutcome::StartsTouching;
    sweep.time = contact.time;
    sweep.gap = contact.nearest.distance;
    sweep.bary = contact.nearest.bary;
    sweep.normal = contact_normal(q, contact.time, contact.nearest);
    sweep.safe_time = find_safe_time(q, contact, limits);
    return sweep;
}

/// Most pairs stand on one side of their common plane during the whole step: one cross product, no nearest point.
template <int Count>
bool stays_on_one_side(const Differences<Count>& q, double distance) noexcept {
    Vec3 n = flat_normal(q.t0);
    if (n.dot(q.t0[0]) < 0.0) n = -n;
    const FreeTime free = find_free_time(q, n, distance);
    return free.from <= 0.0 && free.to >= 1.0;
}

template <int Count>
Sweep sweep_differences(Differences<Count>& q, const SweepLimits& limits) noexcept {
    q.measure();
    if (stays_on_one_side(q, limits.distance)) return {};
    return finish(q, advance(q, 0.0, find_nearest(q.t0), limits.distance, limits.tolerance, limits.max_steps), limits);
}

} // namespace

Sweep sweep_vertex_face(const SweptPoint& vertex, const std::array<SweptPoint, 3>& face, const SweepLimits& limits) noexcept {
    Differences<3> q = make_differences(vertex, face);
    return sweep_differences(q, limits);
}

Sweep sweep_edge_edge(const std::array<SweptPoint, 2>& a, const std::array<SweptPoint, 2>& b, const SweepLimits& limits) noexcept {
    Differences<4> q = make_differences(a, b);
    return sweep_differences(q, limits);
}

} // namespace trocar::collision
