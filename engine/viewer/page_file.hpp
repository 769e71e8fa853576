// The page: one HTML file with everything in it, made from engine/viewer/page by the target viewer_page.
#pragma once

#include "base/result.hpp"

#include <filesystem>
#include <string>

namespace trocar::engine::viewer {

/// Beside the program (page/index.html), or where `cmake --install` puts it (../share/trocar/page/index.html).
/// fails  MissingTool: it was not built; says what builds it
[[nodiscard]] Result<std::string> read_page();
/// The same from a given file.
[[nodiscard]] Result<std::string> read_page(const std::filesystem::path& file);

} // namespace trocar::engine::viewer
