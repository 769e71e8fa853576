// How each body's tissue is advanced: explicit sub-steps and how long they may be, or implicit steps. Bodies that ties join to one another
// (wall_ties.hpp) are advanced together, by one decision: implicitly, or in the leapfrog sub-steps of the one that needs most.
#pragma once

#include "engine/prepare/prepared_scene.hpp"
#include "engine/scene/scene.hpp"

namespace trocar::engine {

/// Of all bodies, once they are there: viscosity, BodyModel::implicit, tied and node_give, and what their summaries say of it.
[[nodiscard]] Result<void> choose_tissue_steps(const Scene& scene, const CoarseBodies& coarse, PreparedScene& prepared);

} // namespace trocar::engine
