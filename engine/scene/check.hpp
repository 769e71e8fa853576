// Checks a JSON tree against its table. Afterwards every value that is there has its type, its length and its range.
#pragma once

#include "engine/scene/json_tree.hpp"
#include "engine/scene/table.hpp"

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace trocar::engine {

/// Inputs of a check besides the tree, and its outputs.
struct CheckContext {
    std::string file_name;        // for messages
    std::filesystem::path folder; // names of files are relative to it
    Units units;
    std::vector<std::string> questions;                         // out: unusual numbers
    std::map<std::string, TextPosition, std::less<>> positions; // out: key path -> value
};

/// "bodies" + "liver" = "bodies.liver"; without a dot at the root.
[[nodiscard]] std::string join_key(std::string_view path, std::string_view key);

/// An error about one value: file, line, column, key path.
[[nodiscard]] Error error_at(const CheckContext& context, TextPosition at, std::string key, std::string message,
                             ErrorCode code = ErrorCode::BadValue);

/// The first mistake in the order of the file; nothing when all is well. Numbers are checked in context.units.
/// path   key path of this object, empty for the root
[[nodiscard]] std::optional<Error> check_object(const JsonNode& node, const ObjectSpec& spec, const std::string& path,
                                                CheckContext& context);

/// Reads "units": declared names into factors. The keys are those of the table's object.
[[nodiscard]] std::optional<Error> read_units(const JsonNode& root, const ObjectSpec& spec, CheckContext& context);

/// The alternative that a value of this JSON type, with these keys, is meant to be; nullptr where none fits.
[[nodiscard]] const ValueSpec* choose_alternative(const JsonNode& node, const ValueSpec& value);

/// A file name as the scene writes it: "${TROCAR_TEST_DATA}" replaced, relative to the scene's folder.
/// fails     with the text of the message alone: unknown variable, variable not set, no such file, a folder
[[nodiscard]] Result<std::filesystem::path> resolve_file(std::string_view name, const std::filesystem::path& folder);

/// What is expected, as a message says it: "a number in mm", "rows of 3 numbers [t, insertion, rotation] in s, mm,
/// rad".
[[nodiscard]] std::string expected(const ValueSpec& value, const Units& units);

/// What is said about a number outside its range.
[[nodiscard]] std::string out_of_range(const JsonNode& node, Dimension dimension, const Range& range, const Units& units);

/// "0.5 mm": in the unit of the scene.
[[nodiscard]] std::string with_unit(double si, Dimension dimension, const Units& units);

} // namespace trocar::engine
