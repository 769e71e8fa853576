// JSON as a tree that keeps the position of every value in its file, so that a mistake can be shown to the line.
#pragma once

#include "base/result.hpp"

#include <string>
#include <string_view>
#include <vector>

namespace trocar::engine {

struct TextPosition {
    std::size_t line = 0, column = 0; // 1-based; columns count characters, not bytes
};

enum class JsonType : std::uint8_t { Null, Flag, Number, Text, List, Object };

struct JsonNode {
    JsonType type = JsonType::Null;
    bool flag = false;
    double number = 0.0;
    std::string text;               // Text: the string; Number: as it was written
    std::string key;                // of an object's member
    TextPosition key_at, at;        // of the key (members only) and of the value
    std::vector<JsonNode> children; // List: elements; Object: members, in the file's order

    /// nullptr when there is no such member.
    [[nodiscard]] const JsonNode* find(std::string_view name) const noexcept;
};

/// Deeper nesting, or more values, is no scene: it is refused before it costs memory.
inline constexpr std::size_t kMaxJsonDepth = 32;
inline constexpr std::size_t kMaxJsonValues = 500'000;

/// Reads one JSON document; // and /* */ comments and a UTF-8 byte order mark are allowed.
/// fails     BadSyntax with line and column (duplicate keys, numbers beyond double, too deep, too many values
/// included);
///           `file_name` is for messages only
[[nodiscard]] Result<JsonNode> parse_json_tree(std::string_view text, std::string_view file_name);

/// The value as a message shows it: -5, "soft", true, a list of 3, an object.
[[nodiscard]] std::string describe(const JsonNode& node);

} // namespace trocar::engine
