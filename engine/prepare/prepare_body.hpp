// One body of a scene: its surface, and what deforms, carries and bounds it.
#pragma once

#include "engine/prepare/prepared_scene.hpp"
#include "engine/scene/scene.hpp"

namespace trocar::engine {

/// Tetrahedra of a deformable body, kept beside the model while bodies that it carries are linked to it.
struct CoarseBodies {
    std::vector<TetMesh> meshes; // [body_count], empty where a body does not deform
};

/// Everything but the links of carried surfaces. Appends to prepared.model.bodies and prepared.bodies.
[[nodiscard]] Result<void> prepare_body(const Scene& scene, const SceneBody& body, PatientShelf& shelf, CoarseBodies& coarse,
                                        PreparedScene& prepared);

/// Hangs the surface of a carried body on its carrier.
[[nodiscard]] Result<void> link_to_carrier(const Scene& scene, std::size_t body, const CoarseBodies& coarse, PreparedScene& prepared);

} // namespace trocar::engine
