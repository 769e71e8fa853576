// `score`: an episode that was written down, simulated again and judged.
#include "engine/cli/commands.hpp"
#include "engine/cli/number_range.hpp"
#include "engine/cli/progress.hpp"
#include "engine/episodes/score.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <memory>

namespace trocar::engine {

namespace {

struct ScoreOptions {
    std::filesystem::path folder, scene;
    double force_limit = 0.5; // N
};

int score(const ScoreOptions& options) {
    ProgressLine progress(true);
    bool differs = false;
    const auto scored = score_episode(options.folder, options.force_limit, options.scene, differs,
                                      [&](const std::string& what) { progress.show(what); });
    progress.clear();
    if (!scored.ok()) {
        const int code = report_error(scored.error());
        return differs ? kExitDiffers : code;
    }
    const EpisodeScore& s = *scored;
    fmt::print("{} to {}: {} actions simulated again, each state as recorded\n", s.scene, s.target, s.actions);
    fmt::print("success {}, safe success {} (no exit, force at most {:g} N)\n", s.success ? "yes" : "no", s.safe ? "yes" : "no", options.force_limit);
    fmt::print("peak force {:.4g} N, exits {}, unresolved {}, assumed {}, overruns {}\n", s.peak_force_n, s.exits, s.unresolved, s.assumed, s.overruns);
    fmt::print("{:.2f} mm to go, reward {:.6g}{}\nstate {:016x}   recorded by build {}\n", 1e3 * s.remaining_m, s.reward,
               s.failure.empty() ? "" : ", stopped: " + s.failure, s.state_hash, s.program);
    return kExitFine;
}

} // namespace

Command add_score_command(CLI::App& app) {
    const auto options = std::make_shared<ScoreOptions>();
    CLI::App* command = app.add_subcommand("score", "Simulate a recorded episode again and judge it");
    command
        ->add_option("episode", options->folder,
                     "folder that `trocar episode`, a sweep of it that keeps folders, or Navigation.record of the Python package has written")
        ->required();
    command->add_option("--scene", options->scene, "its scene file, where that has moved");
    command->add_option("--force-limit", options->force_limit, "N, the largest force of a safe success")->check(number_range(0.0, 1e6));
    return {command, [options] { return score(*options); }};
}

} // namespace trocar::engine
