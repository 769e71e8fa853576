// A scene late in its run: instruments that follow a route are placed along it.
#pragma once

#include "engine/state/state.hpp"

#include <optional>

namespace trocar::engine {

/// A state of such a run: bodies at rest, every instrument with a route as far along it as it reaches, others where they start. None: no
/// instrument has a route.
[[nodiscard]] std::optional<State> lay_along_routes(const SceneModel& model);

} // namespace trocar::engine
