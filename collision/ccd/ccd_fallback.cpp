#include "collision/ccd/ccd_fallback.hpp"

#include "collision/ccd/exact_ccd.hpp"
#include "collision/ccd/sweep_parts.hpp"

#include <cassert>

namespace trocar::collision {
namespace {

/// Do all c_k keep one strict sign on some axis, from t - reach to t + reach? Then the origin, where it is in the plane, is inside.
/// |c_k'| <= 2 * 2 M 2M per coordinate (two products, each of a position at most M and a velocity at most 2 M, twice).
template <int Count>
bool stays_inside(const Differences<Count>& q, double t, double reach) noexcept {
    const auto corner = at(q, t);
    constexpr auto order = around<Count>();
    const double m2 = q.magnitude * q.magnitude;
    const double bound = kCrossRounding * kUnitRoundoff * m2 + 8.0 * m2 * reach * (1.0 + 1e-9);
    std::array<Vec3, Count> c;
    for (std::size_t k = 0; k < Count; ++k) c[k] = corner[order[k]].cross(corner[order[(k + 1) % Count]]);
    for (int axis = 0; axis < 3; ++axis) {
        bool positive = true, negative = true;
        for (std::size_t k = 0; k < Count; ++k) {
            positive = positive && c[k][axis] > bound;
            negative = negative && c[k][axis] < -bound;
        }
        if (positive || negative) return true;
    }
    return false;
}

/// A time at which the features are proven to meet, near `time`; nothing where that is not obvious.
template <int Count>
std::optional<double> prove_contact(const Differences<Count>& q, double time) noexcept {
    double t = time;
    for (int round = 0; round < 2; ++round) {
        const Plane plane = plane_at(q, t);
        t -= plane.value / plane.slope;
        if (!(t >= 0.0 && t <= 1.0) || std::abs(t - time) > kTimeOfImpactError) return std::nullopt;
    }
    const double m = q.magnitude;
    const double bound = kPlaneRounding * kUnitRoundoff * m * m * m + std::numeric_limits<double>::min();
    const double slope = std::abs(plane_at(q, t).slope);
    const double reach = std::max(4.0 * bound / slope, 0x1p-50);
    const double from = t - reach, to = t + reach;
    if (!(reach < kTimeOfImpactError) || from < 0.0 || to > 1.0) return std::nullopt;
    const double before = plane_at(q, from).value, after = plane_at(q, to).value;
    const bool crosses = (before > bound && after < -bound) || (before < -bound && after > bound);
    if (!crosses || !stays_inside(q, t, reach + 0x1p-52)) return std::nullopt;
    return t;
}

template <int Count>
CcdResult make_ccd_result(const Differences<Count>& q, double time, Decision decided_by) noexcept {
    Nearest nearest = find_nearest(at(q, time));
    if (!(nearest.distance <= 1e-9 * q.magnitude)) nearest = find_nearest_robustly(at(q, time));
    CcdResult ccd{.meets = true, .decided_by = decided_by, .time = time, .bary = nearest.bary};
    nearest.distance = 0.0; // it is rounding error: the flat normal is more accurate
    ccd.normal = contact_normal(q, time, nearest);
    return ccd;
}

/// corners   what find_exact_time takes
template <int Count, class First, class Second>
CcdResult decide(Differences<Count>& q, double time, const First& first, const Second& second) {
    q.measure();
    if (const auto proven = prove_contact(q, time)) return make_ccd_result(q, *proven, Decision::Proof);
    if (const auto exact = find_exact_time(first, second)) return make_ccd_result(q, *exact, Decision::Exact);
    return {.decided_by = Decision::Exact};
}

template <std::size_t Count>
bool all_finite(const std::array<SweptPoint, Count>& points) noexcept {
    for (const SweptPoint& p : points)
        if (!is_finite(p.t0) || !is_finite(p.t1)) return false;
    return true;
}

/// As a sweep that is Unresolved at time 0.
CcdResult unresolved() noexcept { return {.meets = true, .time = 0.0}; }

} // namespace

CcdResult run_ccd_fallback(const SweptPoint& vertex, const std::array<SweptPoint, 3>& face) {
    if (!all_finite(std::array{vertex}) || !all_finite(face)) return unresolved();
    const Sweep sweep = sweep_vertex_face(vertex, face, {});
    if (!sweep.hit()) return {};
    Differences<3> q = make_differences(vertex, face);
    return decide(q, sweep.time, vertex, face);
}

CcdResult run_ccd_fallback(const std::array<SweptPoint, 2>& a, const std::array<SweptPoint, 2>& b) {
    if (!all_finite(a) || !all_finite(b)) return unresolved();
    const Sweep sweep = sweep_edge_edge(a, b, {});
    if (!sweep.hit()) return {};
    Differences<4> q = make_differences(a, b);
    return decide(q, sweep.time, a, b);
}

} // namespace trocar::collision
