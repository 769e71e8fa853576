// How the fibres of a body of hgo lie, tetrahedron by tetrahedron, where its material alone does not say it.
#pragma once

#include "base/mesh.hpp"
#include "base/result.hpp"
#include "engine/io/split_cells.hpp"
#include "engine/scene/scene.hpp"
#include "fem/tissue/material.hpp"

#include <string>
#include <vector>

namespace trocar::engine {

struct FibreField {
    std::vector<fem::FibreAxes> axes; // [tet_count]; empty: as the material says
    std::string words;                // how they lie; empty: a law without
    std::string note;                 // what to doubt; empty: nothing
};

/// By the arrays of the body's coarse file, or by the centreline of its lumen: a tetrahedron belongs to the place of it that is nearest in radii of the
/// lumen there, and its fibres lie as fem::find_fibres lays them round the tangent. Nothing for bodies of other laws.
/// mesh: placed, in m; surface: of the body
/// fails  with the scene's file, line and key: no such array, or one with no direction at a cell; a lumen without a centreline
[[nodiscard]] Result<FibreField> make_fibre_field(const Scene& scene, const SceneBody& body, const TetMesh& mesh, const BesideTets& beside, const TriMesh& surface);

} // namespace trocar::engine
