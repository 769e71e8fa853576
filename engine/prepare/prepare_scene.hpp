// A scene becomes a model: for code that reads the model's members, or changes its settings. prepare_scene (prepared.hpp) is the same for
// programs.
#pragma once

#include "engine/prepare/prepared_scene.hpp"

namespace trocar::engine {

/// fails  with the scene's file, line and key
[[nodiscard]] Result<PreparedScene> make_prepared_scene(const Scene& scene, const Progress& progress = {});

} // namespace trocar::engine
