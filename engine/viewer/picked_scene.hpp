// A scene with the picked places in it, beside the scene that they were picked in.
#pragma once

#include "engine/scene/scene.hpp"
#include "engine/viewer/picker.hpp"

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace trocar::engine::viewer {

struct SavedScene {
    std::filesystem::path file;
    std::vector<std::string> notices; // what differs from what one may expect
};

/// The scene's text with the picks: the target among its targets, and what its first instrument follows unless a path drives it, with a
/// tolerance that fits there; the entry as the instrument's, with as much inserted as has room there. All else stays as it is.
/// text     of the scene's file
/// notices  added to
/// fails    BadUsage: nothing is picked; as set_json_value
[[nodiscard]] Result<std::string> put_picks(std::string_view text, const Scene& scene, const Picks& picks, const std::string& target,
                                            std::vector<std::string>& notices);

/// Reads, prepares and plans the way in the new scene; only one that passes is written, under a name that no file has.
/// text   of the scene's file when the viewer began
/// fails  BadUsage: the scene came from no file, the name is taken; CannotWrite; what reading and preparing find
[[nodiscard]] Result<SavedScene> save_picked_scene(std::string_view text, const Scene& scene, const Picks& picks, const SaveScene& asked);

} // namespace trocar::engine::viewer
