// The catheter's dense surface: a ring of vertices around every rod node, closed at both ends.
// Every skin vertex lies within `radius` of the rod's polyline, so spheres of that radius along it cover the skin.
#pragma once

#include "base/mesh.hpp"
#include "base/trig.hpp"
#include "fem/rod/rod.hpp"

namespace trocar::fem {

struct RodSkin {
    std::vector<Triangle> triangles; // closed, outward
    std::vector<Index> vertex_node;  // [vertex_count] rod node whose frame carries the vertex
    unsigned sides = 0;              // vertices of a ring; ring of node i starts at vertex sides * i
    std::vector<SinCos> turn;        // [sides] of a ring's vertices about the axis

    [[nodiscard]] std::size_t vertex_count() const noexcept { return vertex_node.size(); }
};

/// As many sides as bring the skin closest to `triangle_count` triangles, 6 at least.
[[nodiscard]] RodSkin make_rod_skin(const RodModel& model, std::size_t triangle_count);

/// Places the skin around the rod. Rings that have not passed the port are stacked on the port's cross-section: what is
/// outside the body touches nothing.
/// vertex  [vertex_count] m, out      axis  [node_count] scratch
void place_rod_skin(const RodModel& model, const RodSkin& skin, const RodState& state, const RodPort& port, std::span<Vec3> axis,
                    std::span<Vec3> vertex) noexcept;

} // namespace trocar::fem
