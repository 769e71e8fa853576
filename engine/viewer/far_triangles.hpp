// A surface as seen from afar, for pages that draw without a graphics card.
#pragma once

#include "base/mesh.hpp"

namespace trocar::engine::viewer {

/// Fewer triangles on some of the surface's own vertices: they move with it. About as many as asked for; empty where the surface has no
/// more than that already, or cannot be simplified (not a manifold).
[[nodiscard]] std::vector<Triangle> far_triangles(const TriMesh& surface, std::size_t wanted);

} // namespace trocar::engine::viewer
