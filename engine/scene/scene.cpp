#include "engine/scene/scene.hpp"

#include <cmath>
#include <utility>

namespace trocar::engine {
namespace {

/// Rounding of duration / step must not add a step.
constexpr double kStepTolerance = 1e-9; // [-]

} // namespace

std::size_t TimeSpec::step_count() const noexcept { return static_cast<std::size_t>(std::ceil(duration / step * (1.0 - kStepTolerance))); }

Error scene_error(const Scene& scene, std::string key, std::string message, ErrorCode code) {
    Error error{code, std::move(message), scene.file.string(), 0, 0, std::move(key)};
    for (std::string path = error.key;;) {
        const auto found = scene.positions.find(path);
        if (found != scene.positions.end()) {
            error.line = found->second.line;
            error.column = found->second.column;
            return error;
        }
        if (path.empty()) return error;
        const std::size_t cut = path.find_last_of(".[");
        path.resize(cut == std::string::npos ? 0 : cut);
    }
}

Index find_body(const Scene& scene, std::string_view name) noexcept {
    for (Index i = 0; i < scene.bodies.size(); ++i)
        if (scene.bodies[i].name == name) return i;
    return kNoIndex;
}

Index find_target(const Scene& scene, std::string_view name) noexcept {
    for (Index i = 0; i < scene.targets.size(); ++i)
        if (scene.targets[i].name == name) return i;
    return kNoIndex;
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
        for (const auto& [one, other] : {std::pair(".node", ".ele"), std::pair(".ele", ".node")}) // of TetGen, which are read together
            if (body.coarse.file.extension() == one) add(std::filesystem::path(body.coarse.file).replace_extension(other));
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
