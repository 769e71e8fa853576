// The part of a file's name that tells its format.
#pragma once

#include <cctype>
#include <filesystem>
#include <string>

namespace trocar::engine {

/// The extension in small letters, without a final .gz: ".obj" for "Liver.OBJ.gz".
[[nodiscard]] inline std::string mesh_extension(const std::filesystem::path& path) {
    const auto lower = [](std::string text) {
        for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
        return text;
    };
    const std::string last = lower(path.extension().string());
    return last == ".gz" ? lower(path.stem().extension().string()) : last;
}

} // namespace trocar::engine
