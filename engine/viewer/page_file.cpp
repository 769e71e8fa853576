#include "engine/viewer/page_file.hpp"

#include "engine/io/file_bytes.hpp"

#include <fmt/format.h>

namespace trocar::engine::viewer {

namespace fs = std::filesystem;

Result<std::string> read_page(const fs::path& file) { return read_file_bytes(file); }

Result<std::string> read_page() {
    std::error_code failed;
    const fs::path folder = fs::read_symlink("/proc/self/exe", failed).parent_path();
    for (const fs::path& place : {folder / "page" / "index.html", folder / ".." / "share" / "trocar" / "page" / "index.html"})
        if (fs::is_regular_file(place, failed)) return read_page(place);
    return Error{ErrorCode::MissingTool, fmt::format("the viewer's page was not built: {} is not there. It needs nodejs and npm, and "
                                                     "`./start build`, or `cmake --build BUILD --target viewer_page`, builds it",
                                                     (folder / "page" / "index.html").string())};
}

} // namespace trocar::engine::viewer
