#include "engine/scene/scene.hpp"

#include <cmath>

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

} // namespace trocar::engine
