// The table of the scene format, object by object. docs/scene.md is this table in words.
#pragma once

#include "engine/scene/table.hpp"

namespace trocar::engine {

[[nodiscard]] const ObjectSpec& scene_table();
[[nodiscard]] const ObjectSpec& recipe_table();
[[nodiscard]] const ObjectSpec& device_table();

[[nodiscard]] const ObjectSpec& units_table();

} // namespace trocar::engine
