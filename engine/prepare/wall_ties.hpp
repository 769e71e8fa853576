// Walls of vessels that are joined to the organ around them: where the outside of a wall lies in the organ's tetrahedra, ties hold its nodes to them
// (fem/tissue/ties.hpp), and the organ gives up what the wall and its lumen take of its tetrahedra. Equations, alternatives and figures: docs/tissue.md,
// "Walls joined to an organ".
#pragma once

#include "engine/prepare/prepared_scene.hpp"
#include "engine/scene/scene.hpp"

namespace trocar::engine {

/// An organ that has just been made.
struct OrganInHand {
    const TetMesh& mesh;
    fem::Material material;
    fem::TetContrast contrast; // of its regions
};

/// Joins all walls of bodies before it that the scene embeds in it: their BodyModel::joint, and the organ's tissue made again with the room for them.
[[nodiscard]] Result<void> join_walls(const Scene& scene, const OrganInHand& organ, const CoarseBodies& coarse, PreparedScene& prepared,
                                      fem::TissueModel& tissue, BodySummary& summary);

/// BodyModel::tied of all bodies, once they are all there.
void bound_ties(SceneModel& model);

} // namespace trocar::engine
