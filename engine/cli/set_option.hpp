// --set POINTER=VALUE: values in place of the scene's, of all commands that read one scene.
#pragma once

#include "engine/scene/override.hpp"

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace trocar::engine {

/// settings  outlives the command
void add_set_option(CLI::App& command, std::vector<std::string>& settings);

/// fails  as parse_override and read_scene do
[[nodiscard]] Result<Scene> read_set_scene(const std::filesystem::path& file, const std::vector<std::string>& settings);

} // namespace trocar::engine
