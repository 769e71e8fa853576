// Coarse nodes and faces that a body's regions name, and what holds, moves and loads them.
#pragma once

#include "base/mesh.hpp"
#include "base/result.hpp"
#include "engine/prepare/model.hpp"
#include "engine/scene/scene.hpp"

#include <span>

namespace trocar::engine {

/// The body with regions near a surface as lists of nodes, and its own lists checked.
/// places   of the nodes of the coarse mesh's file among these, as lists name them; empty: they are the same
/// before   bodies that are prepared already      own   with its surface
/// fails    a surface that is not there, a node that the mesh does not have
[[nodiscard]] Result<SceneBody> list_region_nodes(const Scene& scene, const SceneBody& body, const std::vector<Vec3>& nodes,
                                                  std::span<const Index> places, const std::vector<BodyModel>& before, const BodyModel& own);

/// Of all nodes; ascending. Of a body that list_region_nodes has gone through.
[[nodiscard]] std::vector<Index> find_region_nodes(const FixedRegion& region, const std::vector<Vec3>& nodes);
[[nodiscard]] std::vector<Index> find_pinned(const std::vector<HeldRegion>& regions, const std::vector<Vec3>& nodes);

/// [faces] Which of some boundary faces of a mesh look into a lumen.
[[nodiscard]] std::vector<bool> face_into(const TetMesh& mesh, std::span<const Triangle> faces, const TriMesh& lumen);

/// Into model.held. Fails where a region that moves is empty, or holds a node of another that moves.
[[nodiscard]] Result<void> prepare_held(const Scene& scene, const SceneBody& body, const std::vector<Vec3>& nodes,
                                        const std::vector<Index>& pinned, BodyModel& model);

/// Into model.loads, with the effect. Fails where a load acts on nothing; says where it acts on held nodes alone.
[[nodiscard]] Result<void> prepare_loads(const Scene& scene, const SceneBody& body, const TetMesh& mesh, const fem::TissueModel& tissue,
                                         BodyModel& model, std::vector<std::string>& notices);

} // namespace trocar::engine
