#include "engine/cli/taken_files.hpp"

namespace trocar::engine {

Result<void> check_not_taken(const std::filesystem::path& file, std::span<const std::filesystem::path> taken, std::string option) {
    for (const std::filesystem::path& other : taken) {
        std::error_code unknown; // a file that is not there yet is like none
        if (std::filesystem::equivalent(file, other, unknown) || file.lexically_normal() == other.lexically_normal())
            return Error{ErrorCode::BadUsage, file.string() + " is read, or written by another option; another file is wanted", {}, 0, 0,
                         std::move(option)};
    }
    return {};
}

std::vector<std::filesystem::path> files_of(const Scene& scene) {
    std::vector<std::filesystem::path> files;
    const auto add = [&files](const std::filesystem::path& file) {
        if (!file.empty()) files.push_back(file);
    };
    add(scene.file);
    for (const SceneBody& body : scene.bodies) {
        add(body.surface.file);
        add(body.coarse.file);
        add(body.spheres);
        for (const HeldRegion& held : body.fixed) add(held.region.file);
        for (const LoadSpec& load : body.loads)
            if (load.region) add(load.region->file);
    }
    for (const SceneInstrument& instrument : scene.instruments) {
        add(instrument.device_file);
        add(instrument.path_file);
    }
    return files;
}

} // namespace trocar::engine
