#include "engine/cli/commands.hpp"
#include "engine/cli/number_range.hpp"
#include "engine/cli/progress.hpp"
#include "engine/io/printable.hpp"
#include "engine/observe/output_folder.hpp"
#include "engine/observe/plan_files.hpp"
#include "engine/scene/scene.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cstdio>
#include <memory>

namespace seldinger::engine {

namespace {

/// Sphere-pair tests per step where the scene's own budget is wall time: a plan must not depend on the machine.
constexpr std::uint64_t kWorkUnits = 200'000;
/// Times the way at the hand's own speed that a trial may take: forks cost several attempts.
constexpr double kPatience = 6.0;
/// s that every trial may take.
constexpr double kShortestTrial = 10.0;

struct PlanOptions {
    std::filesystem::path scene, out;
    std::string target;
    double time_limit = 0.0; // s; 0: from the length of the way
    bool force = false, quiet = false;
};

/// The scene as it is planned in: its first instrument steered to the target, whatever script it has.
Result<void> aim_at(const PlanOptions& options, Scene& scene) {
    if (scene.instruments.empty())
        return Error{ErrorCode::BadUsage, "the scene has no instrument to plan a way for", options.scene.string(), 0, 0, "instruments"};
    const Index target = find_target(scene, options.target);
    if (target == kNoIndex) {
        std::vector<std::string> known;
        for (const SceneTarget& each : scene.targets) known.push_back(each.name);
        return Error{ErrorCode::BadUsage,
                     known.empty() ? fmt::format("no target '{}': the scene names none", options.target)
                                   : fmt::format("no target '{}'; known: {}", options.target, fmt::join(known, ", ")),
                     {},
                     0,
                     0,
                     "--to"};
    }
    SceneInstrument& instrument = scene.instruments.front();
    if (!instrument.follow) instrument.follow.emplace();
    instrument.follow->target = target;
    instrument.follow->speed = std::min(instrument.follow->speed, instrument.speed_limit);
    instrument.path.clear();
    if (scene.budget.limits.mode == BudgetMode::Wall)
        scene.budget.limits = {.mode = BudgetMode::Work, .wall_s = 0.0, .work_units = kWorkUnits};
    return {};
}

/// Too sharp a bend is a reason that there is no way, where the scene says how far the instrument bends.
Result<void> check_bends(const Scene& scene, const RouteReport& route, const std::string& target) {
    const SceneInstrument& instrument = scene.instruments.front();
    if (!(route.sharpest_curvature * instrument.min_bend_radius > 1.0)) return {};
    return scene_error(scene, "instruments." + instrument.name + ".min_bend_radius",
                       fmt::format("no way from the entry to {}: {:.3g} mm along it the lumen bends to a radius of {:.3g} mm, "
                                   "the instrument bends to {:.3g} mm",
                                   target, 1e3 * route.sharpest_curvature_at, 1e3 / route.sharpest_curvature,
                                   1e3 * instrument.min_bend_radius));
}

void print_plan(const PlanRecord& record, const std::filesystem::path& out) {
    const RouteReport& route = record.route;
    fmt::print("way of {:.0f} mm, {:.2f} mm wide at its narrowest, bends to a radius of {:.1f} mm\n", 1e3 * route.length,
               2e3 * route.smallest_radius, route.sharpest_curvature > 0.0 ? 1e3 / route.sharpest_curvature : 0.0);
    if (record.plan.arrived)
        fmt::print("arrived after {:.2f} s with {} retractions, tip {:.2f} mm from {} at the end, lumen exits {}\n", record.plan.time,
                   record.plan.retractions, 1e3 * record.plan.last, record.target, record.plan.lumen_exits);
    fmt::print("path {}   report {}\n", (out / output_name::kPath).string(), (out / output_name::kReport).string());
}

int plan(const PlanOptions& options) {
    Result<Scene> scene = read_scene(options.scene);
    if (!scene.ok()) return report_error(scene.error());
    if (const auto aimed = aim_at(options, *scene); !aimed.ok()) return report_error(aimed.error());
    ProgressLine progress(!options.quiet);
    const auto prepared = prepare_scene(*scene, [&](const std::string& what) { progress.show("preparing " + what); });
    progress.clear();
    if (!prepared.ok()) return report_error(prepared.error());

    const InstrumentModel& instrument = prepared->model.instruments.front();
    PlanRecord record{*scene, *prepared, options.target, inspect_route(*instrument.route, instrument.rod.design.radius), {}};
    if (const auto bends = check_bends(*scene, record.route, options.target); !bends.ok()) return report_error(bends.error());
    const std::filesystem::path out =
        options.out.empty() ? std::filesystem::path("out") / (safe_file_name(scene->name) + "-to-" + options.target) : options.out;
    const auto folder = OutputFolder::open(out, options.force);
    if (!folder.ok()) return report_error(folder.error());
    const double time_limit =
        options.time_limit > 0.0 ? options.time_limit : std::max(kShortestTrial, kPatience * record.route.length / instrument.follow.speed);
    record.plan = find_motion(prepared->model, time_limit, [&](double share) {
        progress.show(fmt::format("driving to {}: {:.0f} % of the time that it may take", options.target, 100.0 * share));
        return false;
    });
    progress.clear();

    std::vector<std::string> notices;
    if (const auto written = write_plan(record, out, notices); !written.ok()) return report_error(written.error());
    for (const std::string& notice : notices) fmt::print(stderr, "notice: {}\n", notice);
    print_plan(record, out);
    if (record.plan.arrived) return kExitFine;
    return report_error({ErrorCode::BadValue,
                         fmt::format("there is a way, but in {:.3g} s the hand found no motion that brings the tip nearer than {:.2f} mm: "
                                     "a longer --time, another tip shape, or a thinner instrument would be right",
                                     record.plan.time, 1e3 * record.plan.closest),
                         {},
                         0,
                         0,
                         "--to"});
}

} // namespace

Command add_plan_command(CLI::App& app) {
    const auto options = std::make_shared<PlanOptions>();
    CLI::App* command = app.add_subcommand("plan", "Find the way to a target and the motion of the hand that goes there");
    command->add_option("scene", options->scene, "scene file (JSON)")->required();
    command->add_option("--to", options->target, "one of the scene's targets")->required();
    command->add_option("--out", options->out, "output folder; out/<scene>-to-<target> where none is given");
    command->add_option("--time", options->time_limit, "s of simulated time that the trial may take")->check(number_range(0.0, 1e5));
    command->add_flag("--force", options->force, "write into an output folder that is not empty");
    command->add_flag("--quiet", options->quiet, "no progress line");
    return {command, [options] { return plan(*options); }};
}

} // namespace seldinger::engine
