// Scenes that grow in one number and stay the same in all others: walls, tissue, bodies, instruments.
#pragma once

#include "base/result.hpp"

#include <cstddef>
#include <filesystem>
#include <string>

namespace trocar::engine {

/// A scene's text, and how many elements it has: as near to what was asked for as its shape allows.
struct GrownScene {
    std::string text;
    std::size_t elements = 0;
};

/// A wire in a static winding lumen of 4 mm, where about so many triangles are the wall. `folder` takes its surface's file.
/// finer   the same 240 mm of lumen, all of its triangles smaller; otherwise more lumen beyond, of triangles as large as ever
/// fails   as write_obj
[[nodiscard]] Result<GrownScene> make_wall_scene(std::size_t triangles, bool finer, const std::filesystem::path& folder);

/// A cube of about so many tetrahedra, 5 mm each, that hangs from its upper side and swings. `folder` takes its mesh's file.
/// fails   as write_vtu
[[nodiscard]] Result<GrownScene> make_tissue_scene(std::size_t tets, const std::filesystem::path& folder);

/// So many soft balls of 10 mm that fall side by side and never meet.
[[nodiscard]] GrownScene make_scattered_scene(std::size_t balls);

/// So many soft balls of 10 mm in a tray, about as high as wide.
[[nodiscard]] GrownScene make_heap_scene(std::size_t balls);

/// So many wires in lumens of their own, or all of them in one, where they press on one another.
[[nodiscard]] GrownScene make_instruments_scene(std::size_t wires, bool in_one_lumen);

} // namespace trocar::engine
