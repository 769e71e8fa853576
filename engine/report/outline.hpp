// The outline of a surface, as a line drawing shows it.
#pragma once

#include "base/mesh.hpp"

#include <vector>

namespace trocar::engine {

/// Edges where a surface turns from the viewer: its outline and its folds.
struct OutlineEdge {
    Vec3 a, b; // m
};
[[nodiscard]] std::vector<OutlineEdge> find_outline(const TriMesh& mesh, const Vec3& view_direction);

} // namespace trocar::engine
