// `explain`: what a scene will simulate and why, what it will not, how many sub-steps, how much memory, what it will cost.
#include "engine/cli/commands.hpp"
#include "engine/cli/progress.hpp"
#include "engine/cli/set_option.hpp"
#include "engine/experiments/explain.hpp"
#include "engine/prepare/prepare_scene.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <cstdio>
#include <memory>

namespace trocar::engine {

namespace {

int explain(const std::filesystem::path& file, const SceneSettings& settings) {
    const Result<Scene> scene = read_set_scene(file, settings);
    if (!scene.ok()) return report_error(scene.error());
    ProgressLine progress(true);
    const auto prepared = make_prepared_scene(*scene, [&](const std::string& what) { progress.show("preparing " + what); });
    progress.clear();
    if (!prepared.ok()) return report_error(prepared.error());
    const auto tell = [&](const std::string& text) {
        progress.clear();
        fmt::print("{}", text);
        std::fflush(stdout);
    };
    explain_scene(*scene, *prepared, tell, [&](const std::string& what) { progress.show(what); });
    return kExitFine;
}

} // namespace

Command add_explain_command(CLI::App& app) {
    const auto scene = std::make_shared<std::filesystem::path>();
    CLI::App* command = app.add_subcommand("explain", "Say what a scene simulates and why, and what it will cost");
    command->add_option("scene", *scene, "scene file (JSON)")->required();
    const auto settings = std::make_shared<SceneSettings>();
    add_set_options(*command, *settings);
    return {command, [scene, settings] { return explain(*scene, *settings); }};
}

} // namespace trocar::engine
