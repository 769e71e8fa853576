// Files that a command line names twice: what is written must not be what is read, nor what another option writes.
#pragma once

#include "base/result.hpp"
#include "engine/scene/scene.hpp"

#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace trocar::engine {

/// fails  BadUsage under the option's name: the file is one of those, by whatever way it is named
[[nodiscard]] Result<void> check_not_taken(const std::filesystem::path& file, std::span<const std::filesystem::path> taken,
                                           std::string option);

/// The scene's own file and all that it names: meshes, sphere trees, recipes, lists of nodes, devices, paths.
[[nodiscard]] std::vector<std::filesystem::path> files_of(const Scene& scene);

} // namespace trocar::engine
