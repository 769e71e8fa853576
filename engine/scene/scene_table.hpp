// The table of the scene format, object by object. docs/scene.md is this table in words.
#pragma once

#include "engine/scene/table.hpp"

namespace trocar::engine {

[[nodiscard]] const ObjectSpec& scene_table();
[[nodiscard]] const ObjectSpec& recipe_table();

/// Parts of the scene's table.
[[nodiscard]] const ObjectSpec& units_table();
[[nodiscard]] const ObjectSpec& body_table();
[[nodiscard]] const ObjectSpec& instrument_table();
[[nodiscard]] ValueSpec target_value();
[[nodiscard]] const ObjectSpec& effects_table();

/// Every effect by name, in the order they are documented.
[[nodiscard]] const std::vector<std::string_view>& effect_names();

} // namespace trocar::engine
