// The table of the scene format, object by object. docs/scene.md is this table in words.
#pragma once

#include "engine/scene/table.hpp"

namespace trocar::engine {

[[nodiscard]] const ObjectSpec& scene_table();
[[nodiscard]] const ObjectSpec& recipe_table();

[[nodiscard]] const ObjectSpec& units_table();

/// Every effect by name, in the order they are documented.
[[nodiscard]] const std::vector<std::string_view>& effect_names();

} // namespace trocar::engine
