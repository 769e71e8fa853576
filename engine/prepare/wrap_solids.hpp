// Wrapped sphere trees for the solid bodies of a scene that asks for them, and trees from files.
#pragma once

#include "engine/prepare/prepared_scene.hpp"
#include "engine/scene/scene.hpp"

namespace trocar::engine {

/// Replaces the covering trees of solid bodies by wrapped ones, and links those of bodies with coarse nodes to the nodes. A surface that
/// the medial builder refuses gets the shell builder's tree, and its summary a note. Trees come from the cache where it has them. Nothing
/// happens where the scene keeps covering trees, or has no two solid bodies. A body that names a file of spheres gets that tree in any case; what
/// it leaves uncovered is a note of its summary and a notice of the scene.
[[nodiscard]] Result<void> wrap_solids(const Scene& scene, PreparedScene& prepared);

} // namespace trocar::engine
