// All offline work: a scene becomes a model that can be stepped.
#pragma once

#include "engine/prepare/prepared_scene.hpp"
#include "engine/scene/scene.hpp"

#include <functional>
#include <string>

namespace trocar::engine {

/// Called before each part of the work with what comes next.
using Progress = std::function<void(const std::string&)>;

/// fails  with the scene's file, line and key
[[nodiscard]] Result<PreparedScene> prepare_scene(const Scene& scene, const Progress& progress = {});

} // namespace trocar::engine
