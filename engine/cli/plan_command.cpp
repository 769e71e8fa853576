#include "engine/cli/commands.hpp"
#include "engine/cli/number_range.hpp"
#include "engine/cli/progress.hpp"
#include "engine/cli/set_option.hpp"
#include "engine/io/printable.hpp"
#include "engine/report/output_folder.hpp"
#include "engine/experiments/plan_files.hpp"
#include "engine/experiments/plan_scene.hpp"
#include "engine/prepare/standing_room.hpp"
#include "engine/scene/scene.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <cstdio>
#include <memory>

namespace trocar::engine {

namespace {

struct PlanOptions {
    std::filesystem::path scene, out;
    std::string target;
    double time_limit = 0.0; // s; 0: from the length of the way
    SceneSettings settings;
    bool force = false, page = true, quiet = false;
};

/// What the tip does when the path is replayed, with the cause of what it swings by.
std::string describe_replay(const PlanRecord& record) {
    const Replay& replay = record.replay;
    std::string text =
        fmt::format("replayed in the scene as it is: tip {:.2f} mm from {} at {:.6g} s", 1e3 * replay.last, record.target, replay.seconds);
    if (const auto& breathing = record.prepared.model.effects.breathing)
        text += fmt::format(", {:.2f} to {:.2f} mm over the last breath (amplitude {:.3g} mm, period {:.3g} s, begun at 0 s)",
                            1e3 * replay.least, 1e3 * replay.most, 1e3 * breathing->amplitude, breathing->period);
    return text;
}

void print_plan(const PlanRecord& record, const std::filesystem::path& out, bool page) {
    const RouteReport& route = record.route;
    fmt::print("way of {:.0f} mm, {:.2f} mm wide at its narrowest, bends to a radius of {:.1f} mm\n", 1e3 * route.length,
               2e3 * route.smallest_radius, route.sharpest_curvature > 0.0 ? 1e3 / route.sharpest_curvature : 0.0);
    if (record.plan.arrived) {
        fmt::print("arrived after {:.2f} s with {} retractions, tip {:.2f} mm from {} at the end, lumen exits {}\n", record.plan.time,
                   record.plan.retractions, 1e3 * record.plan.last, record.target, record.plan.lumen_exits);
        fmt::print("{}\nto follow it: {}\n", describe_replay(record), replay_command(record, (out / output_name::kPath).string()));
    }
    fmt::print("path {}{}\n", (out / output_name::kPath).string(), page ? "   report " + (out / output_name::kReport).string() : "");
}

/// A path is of use where the tip ends within the tolerance; where it does not, what would help is said.
void warn_of_replay(const PlanRecord& record) {
    const double tolerance = record.prepared.model.instruments[kLeadInstrument].follow.tolerance;
    if (record.replay.last <= tolerance) return;
    const SceneModel& model = record.prepared.model;
    const bool moves = std::any_of(model.bodies.begin(), model.bodies.end(), [](const BodyModel& body) { return body.moves(); });
    report_notice(fmt::format("the replayed path ends {:.2f} mm from {}, beyond the tolerance of {:.3g} mm: {}, and a path "
                              "does not see that; \"follow\" in the scene does",
                              1e3 * record.replay.last, record.target, 1e3 * tolerance,
                              moves ? "the organs move it" : "the tip comes to rest elsewhere once the drive stops"));
}

int plan(const PlanOptions& options) {
    Result<Scene> scene = read_set_scene(options.scene, options.settings);
    if (!scene.ok()) return report_error(scene.error());
    const std::string target = options.target.empty() ? usual_target(*scene).value_or("") : options.target;
    if (const auto aimed = aim_to_plan(*scene, target); !aimed.ok()) return report_error(aimed.error());
    const std::filesystem::path out = options.out.empty() ? std::filesystem::path("out") / (safe_file_name(scene->name) + "-to-" + target) : options.out;
    if (const auto free = OutputFolder::check(out, options.force, files_of(*scene)); !free.ok()) return report_error(free.error());
    ProgressLine progress(!options.quiet);
    const auto prepared = make_prepared_scene(*scene, [&](const std::string& what) { progress.show("preparing " + what); });
    progress.clear();
    if (!prepared.ok()) return report_error(prepared.error());

    const InstrumentModel& instrument = prepared->model.instruments[kLeadInstrument];
    PlanRecord record{*scene, *prepared, target, inspect_route(*instrument.route, instrument.rod.design.radius), {}, {}};
    if (const auto bends = check_bends(*scene, record.route, target); !bends.ok()) return report_error(bends.error());
    const auto folder = OutputFolder::open(out, options.force);
    if (!folder.ok()) return report_error(folder.error());
    const double time_limit = options.time_limit > 0.0 ? options.time_limit : usual_trial_time(record.route, instrument);
    record.plan = find_motion(prepared->model, time_limit, [&](double share) {
        progress.show(fmt::format("driving to {}: {:.0f} % of the time that it may take", target, 100.0 * share));
        return false;
    });
    if (record.plan.arrived)
        record.replay = replay_path(prepared->model, rows_as_written(record), [&](double share) {
            progress.show(fmt::format("replaying the path: {:.0f} %", 100.0 * share));
            return false;
        });
    progress.clear();

    std::vector<std::string> notices = note_target(*scene, scene->instruments[kLeadInstrument], instrument, prepared->model.bodies[instrument.lumen],
                                                   prepared->targets[scene->instruments[kLeadInstrument].follow->target].position);
    WrittenOutputs outputs;
    for (const Result<void>& written : write_plan(record, out, notices, options.page)) outputs.note(written);
    for (const std::string& notice : notices) report_notice(notice);
    print_plan(record, out, options.page);
    if (record.plan.arrived) {
        warn_of_replay(record);
        return outputs.tell(out);
    }
    return report_error({ErrorCode::BadValue, describe_failure(record.plan, instrument, record.target), {}, 0, 0, "--to"});
}

} // namespace

Command add_plan_command(CLI::App& app) {
    const auto options = std::make_shared<PlanOptions>();
    CLI::App* command = app.add_subcommand("plan", "Find the way to a target and the drive commands that go there");
    command->add_option("scene", options->scene, "scene file (JSON)")->required();
    command->add_option("--to", options->target, "one of the scene's targets; the one that its first instrument follows, or the only one, where none is given");
    command->add_option("--out", options->out, "output folder; out/<scene>-to-<target> where none is given");
    command->add_option("--time", options->time_limit, "s of simulated time that the trial may take")->check(number_range(0.0, 1e5));
    command->add_flag("--force", options->force, "write into an output folder that is not empty");
    command->add_flag("!--no-report", options->page, "write no report.html");
    add_set_options(*command, options->settings);
    command->add_flag("--quiet", options->quiet, "no progress line");
    return {command, [options] { return plan(*options); }};
}

} // namespace trocar::engine
