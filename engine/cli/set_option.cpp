#include "engine/cli/set_option.hpp"

#include <CLI/CLI.hpp>

namespace trocar::engine {

void add_set_option(CLI::App& command, std::vector<std::string>& settings) {
    command
        .add_option("--set", settings,
                    "POINTER=VALUE: a value in place of the scene's, as in /budget=work:100 or /instruments/catheter/friction=0.1; may be given "
                    "several times")
        ->allow_extra_args(false);
}

Result<Scene> read_set_scene(const std::filesystem::path& file, const std::vector<std::string>& settings) {
    std::vector<SceneOverride> overrides;
    for (const std::string& setting : settings) {
        auto override = parse_override(setting);
        if (!override) return override.error();
        overrides.push_back(std::move(*override));
    }
    return read_scene(file, overrides);
}

} // namespace trocar::engine
