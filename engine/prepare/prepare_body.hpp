// One body of a scene: its surface, its mesh or host mesh, and its sphere tree.
#pragma once

#include "engine/prepare/prepared_scene.hpp"
#include "engine/scene/scene.hpp"

namespace trocar::engine {

/// Links of what lies in a vessel whose host deforms: points of its middle hang on the wall around them where the vessel is its own host, and in the
/// organ's tetrahedra otherwise. None: it has no host.
[[nodiscard]] Result<std::optional<fem::RigidLinks>> link_to_host(const Scene& scene, const CoarseBodies& coarse, const SceneModel& model, std::size_t vessel,
                                                                  std::span<const Vec3> points);

/// Everything but the links of embedded surfaces. Appends to prepared.model.bodies and prepared.bodies.
[[nodiscard]] Result<void> prepare_body(const Scene& scene, const SceneBody& body, PatientShelf& shelf, CoarseBodies& coarse,
                                        PreparedScene& prepared);

/// Embeds the surface of a body in the mesh of its host body.
[[nodiscard]] Result<void> embed_in_host(const Scene& scene, std::size_t body, const CoarseBodies& coarse, PreparedScene& prepared);

} // namespace trocar::engine
