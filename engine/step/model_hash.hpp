// Is this the same scene, prepared the same way?
#pragma once

#include "engine/prepare/model.hpp"

#include <cstdint>

namespace seldinger::engine {

/// Over everything that a step reads and that a scene or its preparation can change, but not the budget: meshes, materials,
/// effects, contact settings, instruments, paths.
[[nodiscard]] std::uint64_t hash_model(const SceneModel& model) noexcept;

} // namespace seldinger::engine
