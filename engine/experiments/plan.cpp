#include "engine/experiments/plan.hpp"

#include "engine/state/state.hpp"
#include "engine/step/simulator.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace trocar::engine {

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

/// s of simulated time for which the drive's motion matters: moving anatomy goes on moving the tip.
double end_of_motion(const SceneModel& model) {
    const bool goes_on = model.effects.breathing || model.effects.pulse;
    return goes_on ? static_cast<double>(model.step_count) * model.step_s : 0.0;
}

/// s, of breathing or pulse, the longer; a single step where neither is.
double longest_period(const SceneModel& model) {
    double period = model.step_s;
    if (model.effects.breathing) period = std::max(period, model.effects.breathing->period);
    if (model.effects.pulse) period = std::max(period, model.effects.pulse->period);
    return period;
}

DriveRow row_of(const State& state) {
    const fem::RodState& rod = state.instruments[kLeadInstrument].rod;
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
        (model.instruments[kLeadInstrument].route->points.back() - simulator.state().instruments[kLeadInstrument].rod.position.back()).squaredNorm());
    plan.progress.push_back(plan.last);
    unsigned attempts = 0;
    const auto goes_on = [&] {
        const double now = simulator.state().time;
        return plan.arrived ? now <= plan.time + kHold || now < end_of_motion(model) : now < time_limit;
    };
    while (goes_on()) {
        const StepReport& report = simulator.step();
        if (!report.finite) break;
        const FollowState& hand = simulator.state().instruments[kLeadInstrument].follow;
        plan.path.push_back(row_of(simulator.state()));
        plan.last = report.target_distance_m;
        plan.closest = std::min(plan.closest, plan.last);
        plan.progress.push_back(plan.last);
        plan.lumen_exits += report.lumen_exits;
        plan.largest_force = std::max(plan.largest_force, report.max_contact_force_n);
        plan.retractions += hand.attempts > attempts ? 1 : 0;
        attempts = hand.attempts;
        plan.furthest = std::max(plan.furthest, hand.best_progress);
        plan.place = attempts > 0 ? hand.fork : hand.progress;
        plan.attempts = attempts;
        if (hand.mode == FollowMode::Arrived && !plan.arrived) {
            plan.arrived = true;
            plan.time = simulator.state().time;
        }
        if (stopped(std::min(1.0, simulator.state().time / time_limit))) break;
    }
    if (!plan.arrived) plan.time = simulator.state().time;
    return plan;
}

std::uint64_t count_replay_steps(const SceneModel& model, std::size_t rows) noexcept {
    return std::max<std::uint64_t>(model.step_count, rows > 0 ? rows - 1 : 0);
}

Replay replay_path(const SceneModel& model, std::vector<DriveRow> rows, const std::function<bool(double)>& stopped) {
    SceneModel replayed = model;
    const std::uint64_t steps = count_replay_steps(model, rows.size());
    replayed.instruments[kLeadInstrument].path = std::move(rows);
    Simulator simulator(replayed);
    Replay replay;
    const double from = static_cast<double>(steps) * model.step_s - longest_period(model);
    replay.least = std::numeric_limits<double>::infinity();
    while (replay.steps < steps) {
        const StepReport& report = simulator.step();
        if (!report.finite) break;
        ++replay.steps;
        replay.seconds = report.time_s;
        replay.lumen_exits += report.lumen_exits;
        replay.last = report.target_distance_m;
        if (report.time_s >= from) replay.least = std::min(replay.least, replay.last), replay.most = std::max(replay.most, replay.last);
        if (stopped(static_cast<double>(replay.steps) / static_cast<double>(steps))) break;
    }
    replay.least = std::min(replay.least, replay.last);
    return replay;
}

} // namespace trocar::engine
