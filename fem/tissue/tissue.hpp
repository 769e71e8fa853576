// A deformable body: linear tetrahedra with lumped mass. The model is built once and only read; the state is all that moves.
#pragma once

#include "base/mesh.hpp"
#include "base/result.hpp"
#include "fem/tissue/force_plan.hpp"
#include "fem/tissue/material.hpp"

#include <span>
#include <vector>

namespace trocar::fem {

/// A body of several tissues of one law: factors on the material for every tet. Empty: 1.
struct TetContrast {
    std::span<const double> stiffness, density; // [tet_count], > 0
    std::span<const FibreAxes> fibres = {};     // [tet_count] of hgo, of length 1; empty: as the material says (find_fibres)
};

struct TissueModel {
    Material material;
    LawConstants law;
    std::vector<Tet> tet_nodes;      // [tet_count] positively oriented
    std::vector<TetShape> tet_shape; // [tet_count]
    std::vector<double> node_mass;   // [node_count] kg, lumped: a quarter of every adjacent tet
    std::vector<double> inv_mass;    // [node_count] 1/kg, 0 pins the node
    std::vector<Vec3> rest_position; // [node_count] m
    std::vector<Index> pinned;       // node ids, ascending, each once
    ForcePlan plan;                  // the same body in the kernels' order
    double volume = 0.0;             // m^3, all tets
    double mass = 0.0;               // kg, all nodes, pinned ones included

    [[nodiscard]] std::size_t node_count() const noexcept { return rest_position.size(); }
    [[nodiscard]] std::size_t tet_count() const noexcept { return tet_nodes.size(); }
};

struct TissueState {
    std::vector<Vec3> position;  // [node_count] m, world
    std::vector<Vec3> velocity;  // [node_count] m/s
    std::vector<double> relaxed; // [relaxation_size] strains of the branches that relax; empty: there are none
};

/// Checks mesh and material and precomputes the rest shape. pinned_nodes in any order, repeats allowed.
/// Fails with BadMesh (first bad tet or node by id: not finite, out of range, repeated node, inverted, flat, node
/// without a tet, repeated tet, more than one part) or BadValue (material, contrast by tet, elements "prisms" of another mesh).
/// sheet: of a wall in layers, nodes a sheet; of other meshes 0
[[nodiscard]] Result<TissueModel> make_tissue_model(const TetMesh& mesh, const Material& material, std::span<const Index> pinned_nodes,
                                                    const TetContrast& contrast = {}, Index sheet = 0);

/// Of a tet of hgo by its place in the plan.
[[nodiscard]] FibreAxes fibres_at(const TissueModel& model, std::size_t batch, std::size_t lane) noexcept;

/// N/m, [node_count]: of each node against its neighbours where they stand, at rest and at constant volume. Shear alone, sum of mu V |grad w|^2
/// over its tets: what an incompressible tissue resists by its volume is no one node's. cost: a pass over the tets
[[nodiscard]] std::vector<double> find_node_stiffness(const TissueModel& model);

/// At rest, without velocity.
[[nodiscard]] TissueState make_rest_state(const TissueModel& model);

/// A tet whose volume is below this fraction of its longest edge cubed is flat: refused. Rounding alone makes 1e-16.
inline constexpr double kFlatTetRatio = 1e-12;

} // namespace trocar::fem
