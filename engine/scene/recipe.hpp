// Recipe files of generated patients: JSON with units, every number optional.
#pragma once

#include "assets/anatomy/recipe.hpp"
#include "base/result.hpp"
#include "engine/scene/check.hpp"

#include <filesystem>
#include <string_view>

namespace trocar::engine {

/// fails     as read_scene does: file, line, column, key, what was found and what was expected
[[nodiscard]] Result<anatomy::Recipe> read_recipe(const std::filesystem::path& file);

/// The same on a text in memory.
[[nodiscard]] Result<anatomy::Recipe> parse_recipe(std::string_view text, const std::filesystem::path& file);

/// The text of a file that stands beside scenes, checked against its table in the units that it declares itself.
/// context  its file name and folder; the rest is filled
[[nodiscard]] Result<JsonNode> parse_checked(std::string_view text, const ObjectSpec& table, CheckContext& context);

/// A whole text file, refused above kMaxSceneBytes before it is read.
[[nodiscard]] Result<std::string> read_json_file(const std::filesystem::path& file);

/// Scenes and recipes are short texts; long paths belong in CSV files.
inline constexpr std::size_t kMaxSceneBytes = std::size_t{16} << 20;

} // namespace trocar::engine
