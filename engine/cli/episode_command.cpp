// `episode`: one episode of a navigation task, without a package of Python: what `sweep` runs many of.
#include "engine/cli/commands.hpp"
#include "engine/cli/number_range.hpp"
#include "engine/cli/progress.hpp"
#include "engine/cli/set_option.hpp"
#include "engine/episodes/make_policy.hpp"
#include "engine/episodes/play.hpp"
#include "engine/io/printable.hpp"
#include "engine/report/output_folder.hpp"
#include "engine/time/interrupt.hpp"
#include "engine/scene/scene.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <memory>

namespace trocar::engine {

namespace {

struct EpisodeOptions {
    std::filesystem::path scene, out; // out empty: out/<scene>-episode
    std::uint64_t seed = 0;
    std::string policy = "random";
    std::string budget; // empty: exact, or what --set says
    TaskOptions task;
    double tolerance_mm = kMillimetre * TaskOptions().tolerance;
    std::vector<double> reward; // empty: the task's own
    SceneSettings settings;
    bool force = false, quiet = false;
};

/// Exact, so that an episode can be repeated on any machine, unless the user names another budget.
Result<std::optional<BudgetLimits>> budget_of(const EpisodeOptions& options) {
    const auto& values = options.settings.values;
    const bool is_set = std::any_of(values.begin(), values.end(), [](const std::string& value) { return value.starts_with("/budget"); });
    if (options.budget.empty() && is_set) return std::optional<BudgetLimits>();
    return std::optional(parse_budget(options.budget.empty() ? "exact" : options.budget)->limits); // checked with the command line
}

void print_episode(const PlayedEpisode& episode, const std::filesystem::path& out) {
    fmt::print("{} to {}, seed {}, policy {}: {} after {} actions, {:.4g} s\n", printable(episode.scene), printable(episode.target), episode.seed,
               printable(episode.policy), episode.success ? "arrived" : "did not arrive", episode.actions, episode.seconds);
    fmt::print("return {:.6g}, tip {:.2f} mm from the target at the end, {:.2f} mm at the closest, peak force {:.4g} N, exits {}\n", episode.reward,
               1e3 * episode.distance, 1e3 * episode.closest, episode.force, episode.exits);
    fmt::print("state {:016x}   {}\n", episode.state_hash, (out / output_name::kSummary).string());
}

int episode(const EpisodeOptions& options) {
    const Result<Scene> scene = read_set_scene(options.scene, options.settings);
    if (!scene) return report_error(scene.error());
    if (const auto known = check_policy(options.policy, {}, PolicyCheck::Name); !known) return report_error(known.error());
    TaskOptions wanted = options.task;
    const auto budget = budget_of(options);
    if (!budget) return report_error(budget.error());
    wanted.budget = *budget;
    wanted.tolerance = options.tolerance_mm / kMillimetre;
    if (!options.reward.empty()) std::copy(options.reward.begin(), options.reward.end(), wanted.reward.begin());
    const std::filesystem::path out =
        options.out.empty() ? std::filesystem::path("out") / (safe_file_name(scene->name) + "-episode") : options.out;
    if (const auto free = OutputFolder::check(out, options.force, files_of(*scene)); !free) return report_error(free.error());
    ProgressLine progress(!options.quiet);
    const auto show = [&](const std::string& what) { progress.show(what); };
    auto prepared = make_prepared_scene(*scene, show);
    progress.clear();
    if (!prepared) return report_error(prepared.error());
    const auto task = make_task(*scene, std::make_shared<const PreparedScene>(std::move(*prepared)), std::move(wanted), show);
    progress.clear();
    if (!task) return report_error(task.error());
    const auto folder = OutputFolder::open(out, options.force);
    if (!folder) return report_error(folder.error());
    const InterruptHold hold(InterruptHold::Then::OwnerEnds);
    const auto played = play_episode(*task, options.seed, options.policy, show);
    progress.clear();
    if (!played) return report_error(played.error());
    if (played->interrupted) return kExitInterrupted;
    const EpisodeSource source{options.scene, {}, options.settings.values, options.settings.anatomy_seed};
    if (const auto written = write_episode(*played, **task, source, out); !written) return report_error(written.error());
    print_episode(*played, out);
    if (!can_be_recorded(**task))
        report_notice(fmt::format("budget {}: how far a step gets depends on the machine, so this is no record for `trocar score`; "
                                  "exact or work:TESTS is",
                                  played->budget));
    if (played->failure.empty()) return kExitFine;
    report_error({ErrorCode::BadValue, "the simulation ended before the episode did: " + played->failure});
    return kExitNotFinite;
}

} // namespace

Command add_episode_command(CLI::App& app) {
    const auto options = std::make_shared<EpisodeOptions>();
    CLI::App* command = app.add_subcommand("episode", "Let a policy drive the instrument to a target, and say what it came to");
    command->add_option("scene", options->scene, "scene file (JSON) with an instrument and targets")->required();
    command->add_option("--seed", options->seed, "what the episode draws follows from it: target, start pose, random actions")
        ->check(CLI::Range(std::uint64_t{0}, std::uint64_t{1} << 63U));
    command->add_option("--policy", options->policy, "random, advance, or a file in Python as in policy.py or policy.py:function; random when absent");
    command->add_option("--to", options->task.targets, "a target that may be drawn; may be given several times; all that can be reached when absent")
        ->allow_extra_args(false);
    command->add_option("--out", options->out, "output folder; out/<scene>-episode where none is given");
    command->add_option("--budget", options->budget, "per step: a time (1ms, 250us), work:TESTS, or exact; exact when absent and not set")->check(budget_text());
    command->add_option("--hold", options->task.hold_s, "s, that an action is held")->check(number_range(1e-6, 60.0));
    command->add_option("--tolerance", options->tolerance_mm, "mm, tip to target: arrived")->check(number_range(0.01, 1000.0));
    command->add_option("--time", options->task.time_limit_s, "s of simulated time; three times what the way takes at full speed, at least 10, when absent")
        ->check(number_range(0.0, 1e5));
    command->add_option("--reward", options->reward, "weights of progress (m), arrival, force (N) and each action")->expected(4)->delimiter(',');
    command->add_option("--start-poses", options->task.start_poses, "turns of the handle and insertions that episodes start from")->check(CLI::Range(1, 1000));
    command->add_flag("--force", options->force, "write into an output folder that is not empty");
    add_set_options(*command, options->settings);
    command->add_flag("--quiet", options->quiet, "no progress line");
    return {command, [options] { return episode(*options); }};
}

} // namespace trocar::engine
