// A scene late in its run: instruments that follow a route are placed along it.
#pragma once

#include "engine/prepare/model.hpp"

#include <string>

namespace trocar::engine {

/// The state of such a run, for Simulator::take_over: bodies at rest, every instrument with a route as far along it as it reaches,
/// others where they start. Empty: no instrument has a route.
[[nodiscard]] std::string lay_along_routes(const SceneModel& model);

} // namespace trocar::engine
