#include "engine/cli/set_option.hpp"

#include <CLI/CLI.hpp>

namespace trocar::engine {

std::vector<std::string> SceneSettings::words() const {
    std::vector<std::string> words;
    for (const std::string& value : values) words.insert(words.end(), {"--set", value});
    if (anatomy_seed) words.insert(words.end(), {"--anatomy-seed", std::to_string(*anatomy_seed)});
    return words;
}

void add_set_options(CLI::App& command, SceneSettings& settings) {
    command
        .add_option("--set", settings.values,
                    "POINTER=VALUE: a value in place of the scene's, as in /budget=work:100 or /instruments/catheter/friction=0.1; may be given "
                    "several times")
        ->allow_extra_args(false);
    command.add_option("--anatomy-seed", settings.anatomy_seed, "seed of the recipes that bodies are generated from: another number is another patient");
}

Result<Scene> read_set_scene(const std::filesystem::path& file, const SceneSettings& settings) {
    std::vector<SceneOverride> overrides;
    for (const std::string& setting : settings.values) {
        auto override = parse_override(setting);
        if (!override) return override.error();
        overrides.push_back(std::move(*override));
    }
    auto scene = read_scene(file, overrides);
    if (!scene || !settings.anatomy_seed) return scene;
    bool is_generated = false;
    for (SceneBody& body : scene->bodies)
        if (body.surface.source == SurfaceSource::Recipe) body.surface.recipe.seed = *settings.anatomy_seed, is_generated = true;
    if (!is_generated) return Error{ErrorCode::BadUsage, "no body of this scene is generated from a recipe; expected it left out", {}, 0, 0, "--anatomy-seed"};
    scene->settings.push_back("--anatomy-seed " + std::to_string(*settings.anatomy_seed));
    return scene;
}

} // namespace trocar::engine
