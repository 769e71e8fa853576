// --set POINTER=VALUE and --anatomy-seed N: values in place of the scene's, of all commands that read one scene.
#pragma once

#include "engine/scene/override.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace trocar::engine {

struct SceneSettings {
    std::vector<std::string> values;           // POINTER=VALUE
    std::optional<std::uint32_t> anatomy_seed; // of the recipes that bodies are generated from; none: their own

    /// As a command line.
    [[nodiscard]] std::vector<std::string> words() const;
};

/// settings  outlives the command
void add_set_options(CLI::App& command, SceneSettings& settings);

/// fails  as parse_override and read_scene do; no body is generated from a recipe that a seed could change
[[nodiscard]] Result<Scene> read_set_scene(const std::filesystem::path& file, const SceneSettings& settings);

} // namespace trocar::engine
