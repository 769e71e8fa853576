#include "engine/observe/plan.hpp"

#include "engine/step/simulator.hpp"

#include <algorithm>
#include <cmath>

namespace seldinger::engine {

namespace {

/// s of simulated time that a plan goes on after it has arrived.
constexpr double kHold = 1.0;
/// Of the instrument's diameter: bends shorter than this do not bend the instrument.
constexpr double kWindowDiameters = 2.0;

/// 1/m; three points in a line, or two that coincide, are straight.
double curvature_of(const Vec3& a, const Vec3& b, const Vec3& c) {
    const double sides = std::sqrt((b - a).squaredNorm() * (c - b).squaredNorm() * (c - a).squaredNorm());
    const double twice_area = std::sqrt((b - a).cross(c - a).squaredNorm());
    return sides > 0.0 ? 2.0 * twice_area / sides : 0.0;
}

DriveRow row_of(const State& state) {
    const fem::RodState& rod = state.instruments.front().rod;
    return {state.time, rod.insertion, rod.rotation};
}

} // namespace

std::vector<double> find_curvature(const Route& route, double window) {
    const std::size_t n = route.points.size();
    std::vector<double> curvature(n, 0.0);
    for (std::size_t i = 0; i < n; ++i) {
        std::size_t before = i, behind = i;
        while (before > 0 && route.length[i] - route.length[before] < window) --before;
        while (behind + 1 < n && route.length[behind] - route.length[i] < window) ++behind;
        if (before < i && i < behind) curvature[i] = curvature_of(route.points[before], route.points[i], route.points[behind]);
    }
    return curvature;
}

RouteReport inspect_route(const Route& route, double instrument_radius) {
    RouteReport report;
    if (route.points.empty()) return report;
    const double spacing = route.length.back() / static_cast<double>(std::max<std::size_t>(route.points.size(), 2) - 1);
    report.length = route.length.back();
    report.curvature = find_curvature(route, std::max(kWindowDiameters * 2.0 * instrument_radius, 3.0 * spacing));
    const auto narrowest = std::min_element(route.radii.begin(), route.radii.end());
    report.smallest_radius = *narrowest;
    report.smallest_radius_at = route.length[static_cast<std::size_t>(narrowest - route.radii.begin())];
    const auto sharpest = std::max_element(report.curvature.begin(), report.curvature.end());
    report.sharpest_curvature = *sharpest;
    report.sharpest_curvature_at = route.length[static_cast<std::size_t>(sharpest - report.curvature.begin())];
    return report;
}

Plan find_motion(const SceneModel& model, double time_limit, const std::function<bool(double)>& stopped) {
    Simulator simulator(model);
    Plan plan;
    plan.path.push_back(row_of(simulator.state()));
    plan.closest = plan.last = std::sqrt(
        (model.instruments.front().route->points.back() - simulator.state().instruments.front().rod.position.back()).squaredNorm());
    plan.progress.push_back(plan.last);
    unsigned attempts = 0;
    while (simulator.state().time < time_limit && !(plan.arrived && simulator.state().time > plan.time + kHold)) {
        const StepReport& report = simulator.step();
        if (!report.finite) break;
        const FollowState& hand = simulator.state().instruments.front().follow;
        plan.path.push_back(row_of(simulator.state()));
        plan.last = report.target_distance_m;
        plan.closest = std::min(plan.closest, plan.last);
        plan.progress.push_back(plan.last);
        plan.lumen_exits += report.lumen_exits;
        plan.largest_force = std::max(plan.largest_force, report.max_contact_force_n);
        plan.retractions += hand.attempts > attempts ? 1 : 0;
        attempts = hand.attempts;
        if (hand.mode == FollowMode::Arrived && !plan.arrived) {
            plan.arrived = true;
            plan.time = simulator.state().time;
        }
        if (stopped(simulator.state().time / time_limit)) break;
    }
    if (!plan.arrived) plan.time = simulator.state().time;
    return plan;
}

} // namespace seldinger::engine
