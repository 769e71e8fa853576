// Words for entries of a table, shared by the schema and the reference page. Units are SI.
#pragma once

#include "engine/scene/table.hpp"

#include <string>
#include <vector>

namespace trocar::engine {

/// "0.1 to 10 m", "more than 0", empty where every number is allowed.
[[nodiscard]] std::string range_text(const Range& range, Dimension dimension);

/// "0.05", "\"J\"", "[0, 0, 1]"; empty where there is none.
[[nodiscard]] std::string default_text(const FieldSpec& field);

/// Every object reachable from one, itself first, each once, in the order of the table.
[[nodiscard]] std::vector<const ObjectSpec*> reachable_objects(const ObjectSpec& root);

} // namespace trocar::engine
