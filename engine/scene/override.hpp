// Values in place of those of a scene's file, named by JSON pointers (RFC 6901) into it: what a command line or a sweep varies.
#pragma once

#include "engine/scene/json_tree.hpp"
#include "engine/scene/scene.hpp"

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace trocar::engine {

struct SceneOverride {
    std::string pointer; // "/instruments/catheter/friction"; names of bodies, instruments and targets as the scene has them
    JsonNode value;      // its positions are 0: it stands in no line of the scene

    /// POINTER=JSON, as parse_override takes it.
    [[nodiscard]] std::string to_string() const;
};

/// Of "POINTER=VALUE"; a value that is no JSON is taken for a string: /budget=work:100.
/// fails  BadUsage
[[nodiscard]] Result<SceneOverride> parse_override(std::string_view text);

/// The keys of a pointer, "~1" and "~0" replaced.
/// fails  BadValue: it does not start with "/", or holds a bad "~"; without a place, which the caller knows
[[nodiscard]] Result<std::vector<std::string>> split_pointer(std::string_view pointer);

/// "/bodies/liver/coarse" = "bodies.liver.coarse", "/a/0" = "a[0]": how messages name a key.
[[nodiscard]] std::string dotted_key(std::string_view pointer);

/// Puts the value where the pointer leads. Objects on the way that the scene leaves out and its schema allows are made; a name or a
/// list's element must be there.
/// returns  the mistake, without a file; the tree is then worthless: key, the part that is unknown, the nearest known one
[[nodiscard]] std::optional<Error> apply_override(JsonNode& scene, const SceneOverride& override);

/// Canonical text of a value: no spaces, numbers as short as reads back the same.
[[nodiscard]] std::string json_text(const JsonNode& node);

/// fails  as read_scene; a pointer that leads nowhere, and a value that does not fit there
[[nodiscard]] Result<Scene> read_scene(const std::filesystem::path& file, std::span<const SceneOverride> overrides);
[[nodiscard]] Result<Scene> parse_scene(std::string_view text, const std::filesystem::path& file, std::span<const SceneOverride> overrides);

} // namespace trocar::engine
