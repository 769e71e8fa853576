// Changes in the text of a scene's file that leave everything else to the byte: comments, order and layout are the user's.
#pragma once

#include "base/result.hpp"

#include <span>
#include <string>
#include <string_view>

namespace trocar::engine {

/// Puts a value at the end of a way of object keys: in place of what stands there, or as the last member. Objects that are missing on the way
/// are made.
/// text   as parse_json_tree accepts it
/// keys   from the root, at least one; value: JSON text
/// fails  BadValue: what stands on the way is no object
[[nodiscard]] Result<std::string> set_json_value(std::string_view text, std::span<const std::string> keys, std::string_view value);

/// A string as JSON text, with its quotes.
[[nodiscard]] std::string json_string(std::string_view text);

} // namespace trocar::engine
