// `--to TARGET`: the target of plan, and the target that a replayed path is measured against.
#pragma once

#include "engine/scene/scene.hpp"

namespace trocar::engine {

/// The first instrument follows this target, with the settings that the scene gives for following, or their defaults.
/// fails     BadUsage: no instrument, or no target of that name (the message lists those there are)
[[nodiscard]] Result<void> aim_first_instrument(Scene& scene, const std::string& target);

} // namespace trocar::engine
