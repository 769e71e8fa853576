// The scene's table in other words: a JSON Schema for editors, a page for people.
#pragma once

#include "engine/scene/table.hpp"

#include <nlohmann/json_fwd.hpp>

#include <string>

namespace trocar::engine {

/// JSON Schema (draft 2020-12) of a file whose root is this object.
[[nodiscard]] nlohmann::ordered_json make_schema(std::string_view title, const ObjectSpec& root);

/// A section for every object that such a file may hold.
[[nodiscard]] std::string reference_markdown(const ObjectSpec& root);

/// JSON Schema (draft 2020-12) of scene files. Ranges of numbers with a dimension depend on the scene's units: the
/// schema states their sign, their descriptions the SI range; the reader checks them.
[[nodiscard]] nlohmann::ordered_json scene_schema();

/// The same as text, as published in assets/scene.schema.json.
[[nodiscard]] std::string scene_schema_text();

/// docs/scene.md.
[[nodiscard]] std::string scene_reference_markdown();

} // namespace trocar::engine
