// Solids that begin inside one another.
#pragma once

#include "engine/prepare/prepared_scene.hpp"

namespace trocar::engine {

/// Lists the solids that lie wholly inside another at the start (SceneModel::nested), where one of the two moves, with a note at each. What
/// is hollow, or embedded in the other, may lie there. Solids that lie partly in one another, and will touch, get a note too.
/// cost   a winding number per vertex, and a query per edge, of solids whose boxes overlap
void find_nested(PreparedScene& prepared);

} // namespace trocar::engine
