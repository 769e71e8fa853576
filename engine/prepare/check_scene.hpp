// A scene that a program wrote or changed itself: what reading one from a file would have refused, as far as preparation and the step
// stand on it. Every name is a number there, and every number may be anything.
#pragma once

#include "engine/scene/scene.hpp"

namespace trocar::engine {

/// A scene that was read passes.
/// fails  BadValue with the key: a number that is not finite or out of its range, an index of nothing, a list that does not ascend
[[nodiscard]] Result<void> check_scene(const Scene& scene);

} // namespace trocar::engine
