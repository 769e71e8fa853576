// Private to engine/render: surfaces and tubes as vertex arrays with normals, ready to travel to the GPU.
#pragma once

#include "base/mesh.hpp"

#include <span>
#include <vector>

namespace trocar::engine {

struct RenderVertex {
    float position[3]; // m, relative to the projection's origin
    float normal[3];   // unit, outwards; zero where the surface has none
};

struct RenderMesh {
    std::vector<RenderVertex> vertices;
    std::vector<Index> indices; // three per triangle
};

/// Smooth normals, weighted by corner angle (Thuermer & Wuethrich 1998), except across creases: a corner whose triangle
/// turns away from the smooth normal by more than kCreaseCosine says keeps its triangle's own.
/// Triangles with ids out of range or non-finite corners are left out.
/// cost     O(vertices + triangles)
void make_render_mesh(std::span<const Vec3> vertices, std::span<const Triangle> triangles, const Vec3& origin, RenderMesh& out);

/// About 50 degrees: the edges of a box stay sharp, the bends of a vessel do not.
inline constexpr double kCreaseCosine = 0.64;

/// A closed tube of circles around the points, with round ends. Non-finite and repeated points are left out.
/// radius   [points] or one for all; m
[[nodiscard]] TriMesh make_tube_mesh(std::span<const Vec3> points, std::span<const double> radius);

} // namespace trocar::engine
