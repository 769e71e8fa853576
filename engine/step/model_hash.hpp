// Is this the same scene, prepared the same way?
#pragma once

#include "engine/prepare/model.hpp"

#include <cstdint>

namespace trocar::engine {

/// Over every member of the model (model_members.hpp), but for what may differ between a run and the one that goes on from it: the
/// scene's file, how many steps are taken, and the budget's limits, which a checkpoint and a record of grants keep themselves. Two lists
/// that run into one another differ, since every list is hashed with its length. Of the preparation's arrays as well as of what the scene
/// says: a program that prepares otherwise makes another model.
/// cost   O(bytes of the model), no allocation
[[nodiscard]] std::uint64_t hash_model(const SceneModel& model) noexcept;

} // namespace trocar::engine
