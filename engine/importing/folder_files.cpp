#include "engine/importing/folder_files.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace trocar::engine {

namespace fs = std::filesystem;

Result<std::vector<fs::path>> list_files(const fs::path& path, std::string_view ending) {
    std::error_code failed;
    if (!fs::exists(path, failed)) return Error{ErrorCode::FileNotFound, "there is no such file or folder", path.string()};
    if (!fs::is_directory(path, failed)) {
        if (path.filename().string().ends_with(ending)) return std::vector{path};
        return Error{ErrorCode::BadUsage, fmt::format("expected a file that ends in {}, or a folder of such files", ending), path.string()};
    }
    std::vector<fs::path> files;
    fs::directory_iterator walk(path, failed);
    for (; !failed && walk != fs::directory_iterator(); walk.increment(failed)) {
        if (!walk->path().filename().string().ends_with(ending)) continue;
        files.push_back(walk->path());
        if (files.size() > kMostFolderFiles)
            return Error{ErrorCode::BadValue, fmt::format("holds more than {} files that end in {}", kMostFolderFiles, ending), path.string()};
    }
    if (failed) return Error{ErrorCode::FileNotFound, fmt::format("cannot be read: {}", failed.message()), path.string()};
    if (files.empty()) return Error{ErrorCode::BadValue, fmt::format("holds no file that ends in {}", ending), path.string()};
    std::sort(files.begin(), files.end());
    return files;
}

} // namespace trocar::engine
