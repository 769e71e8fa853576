// Prisms of walls in layers, three tetrahedra each (mesh/mapped_mesh.hpp), and which two of them make a patch (prisms.hpp).
#pragma once

#include "base/mesh.hpp"
#include "base/result.hpp"

#include <array>
#include <span>
#include <vector>

namespace trocar::fem {

/// Corners of the lower face, ascending, and above each of the upper one.
struct Prism {
    std::array<Index, 6> node;
};

/// sheet: nodes of a sheet of the mesh, by which the ids of a prism's upper corners differ from those of the lower
[[nodiscard]] Prism prism_of(std::span<const Tet> tets, std::size_t prism, Index sheet);

/// Edges of the face in the middle of its height, and half of that, as columns; what is across the face.
[[nodiscard]] Mat3 frame_of(const Prism& prism, std::span<const Vec3> position);
[[nodiscard]] Vec3 normal_of(const Mat3& frame);

/// Fails with BadValue: not the tetrahedra of a layered mesh of so many nodes a sheet.
[[nodiscard]] Result<void> check_prisms(std::span<const Tet> tets, std::size_t node_count, Index sheet);

/// Rows of patches as make_patches gives: one prism or two neighbours of a layer. order: all tets, along which patches begin.
[[nodiscard]] std::vector<Index> pair_prisms(std::span<const Tet> tets, std::span<const Vec3> rest_position, Index sheet, std::span<const Index> order);

} // namespace trocar::fem
