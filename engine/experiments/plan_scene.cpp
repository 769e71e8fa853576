#include "engine/experiments/plan_scene.hpp"

#include "engine/prepare/way_shape.hpp"
#include "engine/scene/nearest.hpp"
#include "engine/step/instrument/script.hpp"
#include "fem/rod/tip_arcs.hpp"

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
/// s that every trial may take beside: a round of attempts at one fork.
constexpr double kRoundTime = 60.0;
/// Times its radius: a lumen that is narrower holds an instrument fast.
constexpr double kTight = 1.5;

/// Places of a tip's curve that are tried for how far it reaches aside.
constexpr std::size_t kReachPoints = 100;

double reach_of(const fem::RodDesign& design) noexcept {
    if (design.tip == fem::TipShape::Straight) return 0.0;
    if (design.tip != fem::TipShape::Curve) return tip_reach(design.tip_length, design.tip_angle);
    double reach = 0.0;
    for (const Vec3& p : fem::draw_arcs(design.arcs, kReachPoints)) reach = std::max(reach, std::hypot(p.x(), p.y()));
    return reach;
}

std::string say_what_helps(const WayPlace& place, unsigned attempts, const fem::RodDesign& design) {
    std::vector<std::string> helps;
    if (place.narrowest < kTight * design.radius) helps.push_back(fmt::format("an instrument thinner than its radius of {:.3g} mm", 1e3 * design.radius));
    if (place.turn > kTurnsBack) helps.push_back("another entry or target, because the way turns back there");
    if (reach_of(design) < place.widest)
        helps.push_back(fmt::format("a tip that reaches {:.3g} mm to the side instead of {:.3g} mm (longer, or bent more)", 2e3 * place.widest,
                                    1e3 * reach_of(design)));
    if (attempts < kAttemptsInARound)
        helps.push_back(fmt::format("a longer --time, because {} attempts at a place are a full round", kAttemptsInARound));
    if (helps.empty()) helps.push_back("another shape of the tip");
    return fmt::to_string(fmt::join(helps, ", or "));
}

std::string describe_missing(const std::string& target, const std::vector<std::string>& known) {
    if (known.empty()) return fmt::format("no target '{}': the scene names none", target);
    if (target.empty()) return fmt::format("the first instrument follows none of the scene's targets; expected one of them: {}", fmt::join(known, ", "));
    return refuse_unknown("target", target, std::vector<std::string_view>(known.begin(), known.end()));
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
                     describe_missing(target, known),
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
    return kRoundTime + kPatience * route.length / instrument.follow.speed;
}

std::string describe_failure(const Plan& plan, const InstrumentModel& instrument, const std::string& target) {
    const Route& route = *instrument.route;
    const WayPlace place = measure_place(route.points, route.radii, find_point_at(route, plan.place));
    return fmt::format("there is a way, but the drive did not come past {:.3g} mm of its {:.3g} mm, where the lumen's radius is {:.3g} to {:.3g} mm and "
                       "the way turns by {:.0f} degrees: {} attempts there in {:.3g} s, and the tip no nearer than {:.2f} mm to {}; expected {}",
                       1e3 * plan.place, 1e3 * route.length.back(), 1e3 * place.narrowest, 1e3 * place.widest, place.turn * 180.0 / std::numbers::pi,
                       plan.attempts, plan.time, 1e3 * plan.closest, target, say_what_helps(place, plan.attempts, instrument.rod.design));
}

} // namespace trocar::engine
