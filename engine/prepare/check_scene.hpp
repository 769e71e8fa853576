// A scene that a program wrote or changed itself: the checks that reading one from a file makes, as far as preparation and the step
// depend on it. Names are indices there, and any value may be out of range.
#pragma once

#include "engine/scene/scene.hpp"

namespace trocar::engine {

/// A scene that was read passes.
/// fails  BadValue with the key: a number that is not finite or out of its range, an index of nothing, a list that does not ascend
[[nodiscard]] Result<void> check_scene(const Scene& scene);

} // namespace trocar::engine
