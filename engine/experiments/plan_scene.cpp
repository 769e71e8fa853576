#include "engine/experiments/plan_scene.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace trocar::engine {

namespace {

/// Multiple of the way's time at drive speed that a trial may take: forks cost several attempts.
constexpr double kPatience = 6.0;
/// s that every trial may take: a round of attempts at one fork.
constexpr double kShortestTrial = 60.0;

/// Radii of the lumen, before and behind a place, over which the way's turn there is measured.
constexpr double kTurnSpan = 3.0;
/// rad; a way that turns more turns back.
constexpr double kTurnsBack = 2.1;
/// Times its radius: a lumen that is narrower holds an instrument fast.
constexpr double kTight = 1.5;
/// Attempts of a round at one place.
constexpr unsigned kRound = 13;

std::size_t point_at(const Route& route, double length) {
    const auto it = std::lower_bound(route.length.begin(), route.length.end(), length);
    return std::min<std::size_t>(static_cast<std::size_t>(it - route.length.begin()), route.points.size() - 1);
}

/// A place on the way that the drive did not pass.
struct HardPlace {
    double radius = 0.0; // m, of the lumen: the widest within that radius behind the place, where the tip has to reach to the side
    double least = 0.0;  // m, the narrowest within that radius
    double turn = 0.0;   // rad, of the way
};

HardPlace measure_place(const Route& route, double length) {
    const std::size_t at = point_at(route, length);
    const double span = kTurnSpan * route.radii[at];
    const std::size_t before = point_at(route, std::max(0.0, length - span)), behind = point_at(route, length + span);
    const auto [least, most] = std::minmax_element(route.radii.begin() + static_cast<std::ptrdiff_t>(before),
                                                   route.radii.begin() + static_cast<std::ptrdiff_t>(behind) + 1);
    const Vec3 in = route.points[at] - route.points[before], out = route.points[behind] - route.points[at];
    return {*most, *least, std::atan2(in.cross(out).norm(), in.dot(out))};
}

/// m to the side, of the tip at rest.
double tip_reach(const fem::RodDesign& design) {
    if (design.tip == fem::TipShape::Straight || !(design.tip_angle > 0.0)) return 0.0;
    const double bend = std::min(design.tip_angle, 0.5 * std::numbers::pi);
    return design.tip_length * (1.0 - std::cos(bend)) / design.tip_angle;
}

std::string say_what_helps(const HardPlace& place, unsigned attempts, const fem::RodDesign& design) {
    std::vector<std::string> helps;
    if (place.least < kTight * design.radius) helps.push_back(fmt::format("an instrument thinner than its radius of {:.3g} mm", 1e3 * design.radius));
    if (place.turn > kTurnsBack) helps.push_back("another entry or target, because the way turns back there");
    if (tip_reach(design) < place.radius)
        helps.push_back(fmt::format("a tip that reaches {:.3g} mm to the side instead of {:.3g} mm (longer, or bent more)", 2e3 * place.radius,
                                    1e3 * tip_reach(design)));
    if (attempts < kRound) helps.push_back(fmt::format("a longer --time, because {} attempts at a place are a full round", kRound));
    if (helps.empty()) helps.push_back("another shape of the tip");
    return fmt::format("{}", fmt::join(helps, ", or "));
}

} // namespace

std::optional<std::string> usual_target(const Scene& scene) {
    if (!scene.instruments.empty())
        if (const auto& follow = scene.instruments[kLeadInstrument].follow) return scene.targets[follow->target].name;
    if (scene.targets.size() == 1) return scene.targets.front().name;
    return {};
}

Result<void> aim_first_instrument(Scene& scene, const std::string& target) {
    if (scene.instruments.empty())
        return Error{ErrorCode::BadUsage, "the scene has no instrument to plan a way for", scene.file.string(), 0, 0, "instruments"};
    const Index index = find_target(scene, target);
    if (index == kNoIndex) {
        std::vector<std::string> known;
        for (const SceneTarget& each : scene.targets) known.push_back(each.name);
        return Error{ErrorCode::BadUsage,
                     known.empty()    ? fmt::format("no target '{}': the scene names none", target)
                     : target.empty() ? fmt::format("the first instrument follows none of the scene's targets; expected one of them: {}", fmt::join(known, ", "))
                                      : fmt::format("no target '{}'; known: {}", target, fmt::join(known, ", ")),
                     {},
                     0,
                     0,
                     "--to"};
    }
    SceneInstrument& instrument = scene.instruments[kLeadInstrument];
    if (!instrument.follow) instrument.follow.emplace();
    instrument.follow->target = index;
    double& speed = instrument.follow->settings.speed;
    speed = std::min(speed, instrument.limits.speed);
    return {};
}

Result<void> aim_to_plan(Scene& scene, const std::string& target) {
    if (auto aimed = aim_first_instrument(scene, target); !aimed.ok()) return aimed;
    scene.instruments[kLeadInstrument].path.clear();
    if (scene.budget.limits.mode == BudgetMode::Wall) scene.budget.limits = {};
    return {};
}

Result<void> check_bends(const Scene& scene, const RouteReport& route, const std::string& target) {
    const SceneInstrument& instrument = scene.instruments[kLeadInstrument];
    if (!(route.sharpest_curvature * instrument.min_bend_radius > 1.0)) return {};
    return scene_error(scene, "instruments." + instrument.name + ".min_bend_radius",
                       fmt::format("no way from the entry to {}: {:.3g} mm along it the lumen bends to a radius of {:.3g} mm, "
                                   "the instrument bends to {:.3g} mm",
                                   target, 1e3 * route.sharpest_curvature_at, 1e3 / route.sharpest_curvature,
                                   1e3 * instrument.min_bend_radius));
}

double usual_trial_time(const RouteReport& route, const InstrumentModel& instrument) noexcept {
    return kShortestTrial + kPatience * route.length / instrument.follow.speed;
}

std::string describe_failure(const Plan& plan, const InstrumentModel& instrument, const std::string& target) {
    const Route& route = *instrument.route;
    const HardPlace place = measure_place(route, plan.place);
    return fmt::format("there is a way, but the drive did not come past {:.3g} mm of its {:.3g} mm, where the lumen's radius is {:.3g} to {:.3g} mm and "
                       "the way turns by {:.0f} degrees: {} attempts there in {:.3g} s, and the tip no nearer than {:.2f} mm to {}; expected {}",
                       1e3 * plan.place, 1e3 * route.length.back(), 1e3 * place.least, 1e3 * place.radius, place.turn * 180.0 / std::numbers::pi,
                       plan.attempts, plan.time, 1e3 * plan.closest, target, say_what_helps(place, plan.attempts, instrument.rod.design));
}

} // namespace trocar::engine
